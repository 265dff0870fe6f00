// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "config/descriptor.h"
#include "daemon/control/varlink_connection.h"

namespace hapticd::daemon {

/// Connections whose clients have been told the last word. Each stays open until its client leaves, for a
/// while at most, and what still comes in is thrown away: closed with unread input, or while its client is
/// still sending, it would give that client a broken pipe instead of the last word. Thread: one.
class LingeringSockets {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 32;  ///< then the oldest is closed
  static constexpr std::chrono::seconds kLongest{30};

  /// Tells the client that nothing more comes. `id`: by which drain() knows it.
  void add(ConnectionId id, config::Descriptor socket, Clock::time_point now);
  /// Throws away some of what has come in; closes the socket when its client has left.
  void drain(ConnectionId id);
  void closeOld(Clock::time_point now);

 private:
  struct Lingering {
    ConnectionId id;
    config::Descriptor socket;
    Clock::time_point end;
  };

  std::vector<Lingering> sockets_;  // the oldest first
};

}  // namespace hapticd::daemon
