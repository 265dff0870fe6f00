// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/clock.h"

namespace hapticd::rt {

/// Chooses moments at a rate, evenly in time, however many come at once.
/// Thread: one.  RT: safe.
class RateChoice {
 public:
  /// rate_hz: 1..1000; a rate that does not divide that of the moments is kept on average.
  explicit RateChoice(int rate_hz) noexcept : rate_hz_(rate_hz) {}

  /// Whether a moment is chosen: the first one in each period. `time_ns`: CLOCK_MONOTONIC, ascending.
  bool takes(std::int64_t time_ns) noexcept {
    const std::int64_t seconds = time_ns / kNsPerSecond;
    const std::int64_t rest_ns = time_ns % kNsPerSecond;
    const std::int64_t period = seconds * rate_hz_ + rest_ns * rate_hz_ / kNsPerSecond;
    if (period == period_) return false;
    period_ = period;
    return true;
  }

 private:
  int rate_hz_;
  std::int64_t period_ = -1;  // the one in which a moment was chosen last
};

}  // namespace hapticd::rt
