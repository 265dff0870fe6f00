// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <list>
#include <optional>
#include <string>
#include <utility>

#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/server/varlink_server.h"

namespace hapticd::daemon {

template <typename T>
bool isReady(const std::future<T>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/// The calls whose answers are not known yet.
/// Thread: control thread only.
class PendingAnswers {
 public:
  /// Returns the answer, or nothing until it is known. It is called repeatedly, but not again once it
  /// answered.
  using Poll = std::move_only_function<std::optional<Reply>()>;

  /// What to do with a Poll for which nobody waits, because the call was oneway or its client has left.
  enum class Unawaited {
    forget,  ///< drop it: it only reads
    finish,  ///< go on: something has to be done when the answer is known
  };

  /// How many calls may wait; some places are reserved for calls that change something.
  static constexpr std::size_t kMaxReads = 32;
  static constexpr std::size_t kMaxPending = 64;
  /// The reason given to a call that is refused because too many wait.
  static constexpr const char* kFullReason =
      "too many requests wait for the disk or the camera (try again later)";
  /// Whether there is no place for another waiting call.
  bool full(Access access) const noexcept {
    return entries_.size() >= (access == Access::read ? kMaxReads : kMaxPending);
  }

  /// Answers `call` at once, or as soon as it can be.
  void add(const Call& call, const Caller& caller, Replies& replies, Unawaited unawaited, Poll poll);
  /// To be called every few milliseconds.
  void answer(Replies& replies);
  void closed(ConnectionId connection);

 private:
  struct Entry {
    ConnectionId connection;
    Unawaited unawaited;
    Poll poll;
  };

  std::list<Entry> entries_;
};

/// Waits for `future`, then makes the reply from its value.
template <typename T>
PendingAnswers::Poll whenReady(std::future<T> future, std::move_only_function<Reply(T)> replyTo) {
  return [future = std::move(future), replyTo = std::move(replyTo)]() mutable -> std::optional<Reply> {
    if (!isReady(future)) return std::nullopt;
    return replyTo(future.get());
  };
}

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
