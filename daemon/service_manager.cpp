// SPDX-License-Identifier: Apache-2.0
#include "daemon/service_manager.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cstdlib>
#include <utility>

namespace hapticd::daemon {

ServiceManager::ServiceManager() {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    sockets_.emplace(names[i], SD_LISTEN_FDS_START + i);
    std::free(names[i]);
  }
  std::free(names);

  std::uint64_t watchdog_us = 0;
  if (::sd_watchdog_enabled(0, &watchdog_us) > 0) feed_period_ = std::chrono::microseconds(watchdog_us / 4);
}

int ServiceManager::takeSocket(const std::string& name) {
  const auto found = sockets_.extract(name);
  return found ? found.mapped() : -1;
}

void ServiceManager::ready() {
  ::sd_notify(0, "READY=1");
}

void ServiceManager::reloading() {
  const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch());
  ::sd_notify(0, fmt::format("RELOADING=1\nMONOTONIC_USEC={}", now_us.count()).c_str());
}

void ServiceManager::stopping() {
  ::sd_notify(0, "STOPPING=1\nSTATUS=stopping");
}

void ServiceManager::showState(const std::string& line) {
  if (line == state_) return;
  state_ = line;
  ::sd_notify(0, ("STATUS=" + line).c_str());
}

void ServiceManager::feedWatchdog(std::uint64_t heartbeat, Clock::time_point now) {
  if (feed_period_ == Clock::duration::zero() || heartbeat == last_heartbeat_ ||
      now - last_fed_ < feed_period_)
    return;
  last_heartbeat_ = heartbeat;
  last_fed_ = now;
  ::sd_notify(0, "WATCHDOG=1");
}

}  // namespace hapticd::daemon
