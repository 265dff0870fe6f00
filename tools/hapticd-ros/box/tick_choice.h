// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/clock.h"

namespace hapticd::tools::ros {

/// Chooses ticks at a rate, evenly in the time at which they were due, however many come at once.
/// Thread: one.  RT: not safe.
class TickChoice {
 public:
  /// rate_hz: 1..1000; a rate that does not divide that of the ticks is kept on average.
  explicit TickChoice(int rate_hz) : rate_hz_(rate_hz) {}

  /// Whether a tick is chosen: the first one due in each period. `planned_ns`: CLOCK_MONOTONIC, ascending.
  bool takes(std::int64_t planned_ns) {
    const std::int64_t seconds = planned_ns / rt::kNsPerSecond;
    const std::int64_t rest_ns = planned_ns % rt::kNsPerSecond;
    const std::int64_t period = seconds * rate_hz_ + rest_ns * rate_hz_ / rt::kNsPerSecond;
    if (period == period_) return false;
    period_ = period;
    return true;
  }

 private:
  int rate_hz_;
  std::int64_t period_ = -1;  // the one in which a tick was chosen last
};

/// Converts CLOCK_MONOTONIC to UTC. The offset is measured, and follows a clock that is set.
/// Thread: one.
class UtcClock {
 public:
  UtcClock() { measure(); }

  /// Measures the offset between the two clocks, to a microsecond unless the thread is interrupted each time.
  void measure() {
    std::int64_t best_ns = rt::kNsPerSecond;
    for (int i = 0; i < 3; ++i) {
      const std::int64_t before_ns = rt::monotonicNow_ns();
      const std::int64_t utc_ns = rt::realtimeNow_ns();
      const std::int64_t took_ns = rt::monotonicNow_ns() - before_ns;
      if (took_ns >= best_ns) continue;
      best_ns = took_ns;
      offset_ns_ = utc_ns - before_ns - took_ns / 2;
    }
  }
  std::int64_t utc_ns(std::int64_t monotonic_ns) const { return monotonic_ns + offset_ns_; }

 private:
  std::int64_t offset_ns_ = 0;
};

}  // namespace hapticd::tools::ros
