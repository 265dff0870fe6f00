// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <optional>
#include <utility>

#include "daemon/control/varlink_server.h"

namespace hapticd::daemon {

template <typename T>
bool isReady(const std::future<T>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/// Calls whose answers are not known yet.
/// Thread: control thread only.
class PendingAnswers {
 public:
  /// The answer, or nothing until it is known. Asked again and again; never after it has answered.
  using Poll = std::move_only_function<std::optional<Reply>()>;

  /// What becomes of a Poll that nobody waits for, because the call was oneway or its client has left.
  enum class Unawaited {
    forget,     ///< it only watches
    bring_end,  ///< something is still to be done when the answer is known
  };

  /// How many calls may wait; a few places are kept for those who change something.
  static constexpr std::size_t kMostReads = 32;
  static constexpr std::size_t kMost = 64;
  /// What a call that must not wait is told.
  static constexpr const char* kFullReason =
      "too many requests wait for the disk or the camera (try again later)";
  /// Whether another call must not wait.
  bool full(Access access) const noexcept {
    return entries_.size() >= (access == Access::read ? kMostReads : kMost);
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

/// Waits for `future`, then makes the reply of its value.
template <typename T>
PendingAnswers::Poll whenReady(std::future<T> future, std::move_only_function<Reply(T)> replyTo) {
  return [future = std::move(future), replyTo = std::move(replyTo)]() mutable -> std::optional<Reply> {
    if (!isReady(future)) return std::nullopt;
    return replyTo(future.get());
  };
}

}  // namespace hapticd::daemon
