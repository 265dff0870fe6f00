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

/// What the methods of all themes work with.
/// Thread: control thread only.
struct MethodContext {
  Box& box;
  std::chrono::milliseconds apply_timeout{};
  std::function<void(const JournalEntry&)> log = {};  ///< may be empty
  PendingAnswers pending = {};
};

/// Logs a change; `fields`: of the entry, beside those that say who it was.
void logChange(const MethodContext& context, const Caller& caller, const std::string& change,
               JournalFields fields);

/// Logs each live parameter that `after` has otherwise than `before`, and returns their names. `change`:
/// what happens to them ("sets", "profile soft sets").
std::vector<std::string> logParameters(const MethodContext& context, const Caller& caller,
                                       const std::string& change, const config::Settings& before,
                                       const config::Settings& after);

/// Waits until the force loop has taken over `generation`, then gives `reply()`. After the time-out gives
/// io.hapticd.Control.NotApplied.
PendingAnswers::Poll whenApplied(MethodContext& context, std::uint64_t generation,
                                 std::move_only_function<Reply()> reply);

}  // namespace hapticd::daemon
