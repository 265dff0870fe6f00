// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "config/settings.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/pending_answers.h"

namespace hapticd::daemon {

/// Data shared by the methods of all topics.
/// Thread: control thread only.
struct MethodContext {
  Box& box;
  std::chrono::milliseconds apply_timeout{};
  std::function<void(const JournalEntry&)> log = {};  ///< may be empty
  PendingAnswers pending = {};
};

/// Logs a change as an event; `fields`: of the entry, in addition to those that identify the caller.
void logChange(const MethodContext& context, const Caller& caller, const std::string& change,
               config::EventKind event, JournalFields fields);

/// Logs each live parameter whose value in `after` differs from that in `before`, and returns their names.
/// `change`: the verb of the log entry ("sets", "profile soft sets").
std::vector<std::string> logParameters(const MethodContext& context, const Caller& caller,
                                       const std::string& change, const config::Settings& before,
                                       const config::Settings& after);

/// Logs each fixture and region that differs. `change`: stands before the verb of each entry ("loads profile
/// soft, which"); may be empty.
void logAdditions(const MethodContext& context, const Caller& caller, const std::string& change,
                  const config::SceneAdditions& before, const config::SceneAdditions& after);

/// Waits until the force loop has taken over `generation`, then answers with `reply()`; after the time-out
/// with io.hapticd.Control.NotApplied.
PendingAnswers::Poll whenApplied(MethodContext& context, std::uint64_t generation,
                                 std::move_only_function<Reply()> reply);

}  // namespace hapticd::daemon
