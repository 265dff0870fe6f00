// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/clock.h"

namespace hapticd::tools::ros {

/// Converts CLOCK_MONOTONIC to UTC. The offset is measured, and follows a clock that is set.
/// Thread: one.
class UtcClock {
 public:
  UtcClock() { measure(); }

  /// Measures the offset between the two clocks, to some microseconds unless the thread is interrupted each
  /// time.
  void measure() {
    std::int64_t best_ns = rt::kNsPerSecond;
    for (int i = 0; i < kAttempts && best_ns > kGood_ns; ++i) {
      const std::int64_t before_ns = rt::monotonicNow_ns();
      const std::int64_t utc_ns = rt::realtimeNow_ns();
      const std::int64_t took_ns = rt::monotonicNow_ns() - before_ns;
      if (took_ns >= best_ns) continue;
      best_ns = took_ns;
      offset_ns_ = utc_ns - before_ns - took_ns / 2;
    }
  }
  std::int64_t utc_ns(std::int64_t monotonic_ns) const { return monotonic_ns + offset_ns_; }
  std::int64_t monotonic_ns(std::int64_t utc_ns) const { return utc_ns - offset_ns_; }

 private:
  static constexpr int kAttempts = 10;
  static constexpr std::int64_t kGood_ns = 1000;  // between two readings of the same clock

  std::int64_t offset_ns_ = 0;
};

}  // namespace hapticd::tools::ros
