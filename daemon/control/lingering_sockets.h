// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "config/descriptor.h"
#include "daemon/control/varlink_connection.h"

namespace hapticd::daemon {

/// Connections that got their final reply. Each stays open for a while, until its client leaves, and further
/// input is discarded: if it were closed with unread input, or while its client is still sending, the client
/// would see a broken pipe instead of the final reply. Thread: one.
class LingeringSockets {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 32;
  static constexpr std::chrono::seconds kLongest{30};

  /// Beyond `most`, at most kMost, the oldest is closed.
  void limit(std::size_t most) { most_ = most; }

  /// Shuts down sending to the client, and takes the socket. `id`: names it in drain().
  void add(ConnectionId id, config::Descriptor socket, Clock::time_point now);
  /// Discards some of the input; closes the socket when its client has left.
  void drain(ConnectionId id);
  void closeOld(Clock::time_point now);

 private:
  struct Lingering {
    ConnectionId id;
    config::Descriptor socket;
    Clock::time_point end;
  };

  std::size_t most_ = kMost;
  std::vector<Lingering> sockets_;  // the oldest first
};

}  // namespace hapticd::daemon
