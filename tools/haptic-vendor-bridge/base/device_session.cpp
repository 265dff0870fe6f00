// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/base/device_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace hapticd::tools {

DeviceReading DeviceExchange::newest(std::int64_t now_ns) {
  const std::uint64_t opening = open_.load(std::memory_order_acquire);
  const bool fresh = readings_.refresh();
  const Reading& newest = readings_.front();
  DeviceReading reading = newest.reading;
  const std::int64_t age_ns = std::max(now_ns - newest.measured_ns, std::int64_t{0});
  if (opening == 0 || newest.opening != opening || age_ns > kDeadManNs) {
    reading.fault = true;
    delay_.reset();
    return reading;
  }
  if (fresh) delay_.add(age_ns + command_wait_ns_.load(std::memory_order_relaxed));
  reading.latency_ns += delay_.ninetyFifthPercentileNs();
  return reading;
}

void DeviceExchange::command(const DeviceCommand& command, std::int64_t now_ns) {
  commands_.write({command, now_ns});
}

DeviceLimits DeviceExchange::limits() const {
  if (open_.load(std::memory_order_acquire) == 0) return {};
  return {.force_n = force_n_.load(std::memory_order_relaxed),
          .torque_n_m = torque_n_m_.load(std::memory_order_relaxed),
          .gripper_force_n = gripper_force_n_.load(std::memory_order_relaxed)};
}

void DeviceExchange::open(const DeviceLimits& limits) {
  force_n_.store(limits.force_n, std::memory_order_relaxed);
  torque_n_m_.store(limits.torque_n_m, std::memory_order_relaxed);
  gripper_force_n_.store(limits.gripper_force_n, std::memory_order_relaxed);
  open_.store(++openings_, std::memory_order_release);
}

void DeviceExchange::publish(const DeviceReading& reading, std::int64_t measured_ns) {
  readings_.write({reading, measured_ns, open_.load(std::memory_order_relaxed)});
}

DeviceCommand DeviceExchange::commandAt(std::int64_t now_ns) {
  commands_.refresh();
  const Command& newest = commands_.front();
  const std::int64_t age_ns = now_ns - newest.written_ns;
  if (newest.written_ns != taken_ns_) {
    taken_ns_ = newest.written_ns;
    command_wait_ns_.store(std::max(age_ns, std::int64_t{0}), std::memory_order_relaxed);
  }
  return age_ns < kDeadManNs ? newest.command : DeviceCommand{};
}

void DeviceSession::say(const std::string& text) {
  fmt::print(stderr, "{}: {}\n", name_, text);
}

void DeviceSession::opened(const DeviceAbout& about) {
  say(fmt::format("{} ready{}", about.model.empty() ? "device" : about.model,
                  about.serial.empty() ? "" : fmt::format(" (serial number {})", about.serial)));
  opened_ = true;
  exchange_.open(about.limits);
}

}  // namespace hapticd::tools
