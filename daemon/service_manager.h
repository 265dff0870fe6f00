// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "config/base/descriptor.h"

namespace hapticd::daemon {

/// The connection to the service manager (sd_listen_fds(3), sd_notify(3)). All functions do nothing if there
/// is no service manager or it did not request notifications. None waits for the service manager, as
/// sd_notify() would: a notification that it does not take is sent again by feedWatchdog().
/// Thread: control thread only.
class ServiceManager {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes over the sockets that the service manager passed, and removes the environment variables that
  /// describe them.
  ServiceManager();

  /// The listening socket of that name (FileDescriptorName= of the socket unit), or -1. The caller owns it.
  int takeSocket(const std::string& name);

  void ready();
  void reloading();
  void stopping();
  /// Sends a line for `systemctl status` if it differs from the last one.
  void showState(const std::string& line);

  /// Feeds the watchdog if `heartbeat` has changed since the last time, so that a force loop that has
  /// stopped ends the daemon, whatever else still runs. To be called at least every quarter of the watchdog's
  /// time.
  void feedWatchdog(std::uint64_t heartbeat, Clock::time_point now);

  /// Notifications that were dropped and times at which the watchdog could not be fed when due, since the
  /// start.
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  enum class Sent { done, full, failed };

  void connectTo(std::string address);
  Sent trySend(const std::string& message) const;
  void send(std::string message);
  void sendWaiting();

  std::map<std::string, int> sockets_;
  base::Descriptor socket_;  // none: there is no service manager
  sockaddr_un address_{};
  socklen_t address_bytes_ = 0;
  std::deque<std::string> waiting_;  // oldest first
  std::uint64_t lost_ = 0;
  std::string state_;
  Clock::duration feed_period_{};  // 0: there is no watchdog
  Clock::time_point last_fed_;
  bool feed_failed_ = false;  // the one that is due
  std::uint64_t last_heartbeat_ = 0;
};

}  // namespace hapticd::daemon
