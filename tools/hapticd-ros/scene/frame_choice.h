// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/base/clock.h"

namespace hapticd::tools::ros {

/// Chooses frames of a camera, whose rate is not known and not quite even, so that their mean rate is at most
/// a given one; a camera that is no faster has all its frames chosen.
/// Thread: one.
class FrameChoice {
 public:
  /// rate_hz: > 0.
  explicit FrameChoice(int rate_hz) : period_ns_(rt::kNsPerSecond / rate_hz) {}

  /// Whether a frame that came at this time is chosen; CLOCK_MONOTONIC, ascending.
  bool takes(std::int64_t time_ns) {
    // what was saved covers a frame that comes early after one that came late
    saved_ns_ = std::min(saved_ns_ + time_ns - before_ns_, kMostSaved * period_ns_);
    before_ns_ = time_ns;
    if (saved_ns_ < period_ns_) return false;
    saved_ns_ -= period_ns_;
    return true;
  }

 private:
  static constexpr std::int64_t kMostSaved = 2;  // periods

  std::int64_t period_ns_;
  std::int64_t before_ns_ = 0;
  std::int64_t saved_ns_ = 0;
};

}  // namespace hapticd::tools::ros
