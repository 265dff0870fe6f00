// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

namespace hapticd::daemon {

/// The service manager's side of the daemon (sd_listen_fds(3), sd_notify(3)). Without one, or when it did not
/// ask for it, everything here does nothing.
/// Thread: control thread only.
class ServiceManager {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes over the sockets that were passed, and forgets the environment variables about it.
  ServiceManager();

  /// The listening socket of that name (FileDescriptorName= of the socket unit), or -1. Belongs to the
  /// caller.
  int takeSocket(const std::string& name);

  void ready();
  void reloading();
  void stopping();
  /// One line for `systemctl status`; sent when it differs from the last one.
  void showState(const std::string& line);

  /// Feeds the watchdog if `heartbeat` has moved since it was last fed, so that a standing force loop ends
  /// the daemon whatever else still runs. To be called at least every quarter of the watchdog's time.
  void feedWatchdog(std::uint64_t heartbeat, Clock::time_point now);

 private:
  std::map<std::string, int> sockets_;
  std::string state_;
  Clock::duration feed_period_{};  // 0: nobody watches
  Clock::time_point last_fed_;
  std::uint64_t last_heartbeat_ = 0;
};

}  // namespace hapticd::daemon
