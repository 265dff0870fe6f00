// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

namespace hapticd::daemon {

/// The connection to the service manager (sd_listen_fds(3), sd_notify(3)). All functions do nothing if there
/// is no service manager or it did not request notifications. Thread: control thread only.
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

 private:
  std::map<std::string, int> sockets_;
  std::string state_;
  Clock::duration feed_period_{};  // 0: there is no watchdog
  Clock::time_point last_fed_;
  std::uint64_t last_heartbeat_ = 0;
};

}  // namespace hapticd::daemon
