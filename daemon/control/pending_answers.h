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
  static constexpr std::size_t kMostReads = 32;
  static constexpr std::size_t kMost = 64;
  /// The reason given to a call that is refused because too many wait.
  static constexpr const char* kFullReason =
      "too many requests wait for the disk or the camera (try again later)";
  /// Whether there is no place for another waiting call.
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

/// Waits for `future`, then makes the reply from its value.
template <typename T>
PendingAnswers::Poll whenReady(std::future<T> future, std::move_only_function<Reply(T)> replyTo) {
  return [future = std::move(future), replyTo = std::move(replyTo)]() mutable -> std::optional<Reply> {
    if (!isReady(future)) return std::nullopt;
    return replyTo(future.get());
  };
}

}  // namespace hapticd::daemon
