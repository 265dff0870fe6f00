// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace hapticd::drivers {

/// Converts a device's timestamps to this computer's clock. Reports arrive late when this computer is busy,
/// so arrival times are unsuitable. The report with the smallest latency determines the difference of the
/// clocks; the difference may grow by 0.1 %, more than two crystals differ, to follow their drift.
/// Thread: one.  RT: safe.
class DeviceClock {
 public:
  /// Longest plausible delay of a report; a larger deviation is a fault of the device's clock.
  static constexpr std::int64_t kLongestDelayNs = 50'000'000;

  void reset() { last_us_.reset(); }

  /// Returns the time of a measurement, at most `arrival_ns`. `device_us` wraps around.
  std::int64_t timeOf(std::uint32_t device_us, std::int64_t arrival_ns) {
    if (last_us_) {
      const std::int64_t step_ns = std::int64_t{1000} * static_cast<std::int32_t>(device_us - *last_us_);
      device_ns_ += step_ns;
      difference_ns_ += std::max<std::int64_t>(0, step_ns) / 1000;
    }
    const std::int64_t difference_ns = arrival_ns - device_ns_;
    if (!last_us_ || difference_ns - difference_ns_ > kLongestDelayNs) difference_ns_ = difference_ns;
    last_us_ = device_us;
    difference_ns_ = std::min(difference_ns_, difference_ns);
    return device_ns_ + difference_ns_;
  }

 private:
  std::optional<std::uint32_t> last_us_;  // nothing before the first report
  std::int64_t device_ns_ = 0;            // device time without wrapping
  std::int64_t difference_ns_ = 0;        // difference to this computer's clock
};

}  // namespace hapticd::drivers
