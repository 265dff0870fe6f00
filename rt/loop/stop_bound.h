// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/safety/safety_chain.h"

namespace hapticd::rt {

/// Limits the time that a stopping force loop waits for its stages to bring the force to zero. They get the
/// time that slew limit and low-pass need plus a margin, at most kMax_s; any remaining force is then
/// released in SafetyChain::kReleaseTicks equal steps, and the loop ends in any case.
/// Thread: one.  Progress: wait-free.  RT: safe.
class StopBound {
 public:
  static constexpr double kMax_s = 5;

  /// Returns the number of ticks before the release. `command_n`: the force exerted when the loop is asked to
  /// stop.
  static std::uint64_t ticks(const Vec3& command_n, const SafetyParameters& parameters,
                             double period_s) HAPTICD_RT {
    const double ramp_s = std::max(norm(command_n), parameters.max_force_n) / parameters.max_slew_n_per_s;
    const double filter_s = parameters.force_filter_hz > 0
                                ? std::log(kMaxForce_n / LowPass::kArrived_n) /
                                      (2 * std::numbers::pi * parameters.force_filter_hz)
                                : 0;
    const double bound_s = ramp_s + filter_s + kSpare_s;
    // also if NaN
    return static_cast<std::uint64_t>(std::ceil((bound_s < kMax_s ? bound_s : kMax_s) / period_s));
  }

  /// Starts the count. `planned_ns`: due time of the first tick of the stop.
  void begin(const Vec3& command_n, const SafetyParameters& parameters, double period_s,
             std::int64_t planned_ns) HAPTICD_RT {
    ticks_left_ = ticks(command_n, parameters, period_s);
    end_ns_ = planned_ns + static_cast<std::int64_t>(kMax_s * 1e9);
  }

  /// Called before each tick of the stop; returns whether it is to release the force.
  bool releases(std::int64_t planned_ns) HAPTICD_RT {
    if (ticks_left_ > 0 && planned_ns < end_ns_) {
      --ticks_left_;
      return false;
    }
    ticks_left_ = 0;
    ++released_ticks_;
    return true;
  }

  /// Returns true once the force has been released.
  bool isOver() const HAPTICD_RT { return released_ticks_ >= SafetyChain::kReleaseTicks; }

 private:
  /// Larger than the force of any box.
  static constexpr double kMaxForce_n = 1000;
  static constexpr double kSpare_s = 0.1;

  std::uint64_t ticks_left_ = 0;
  std::int64_t end_ns_ = 0;
  int released_ticks_ = 0;
};

}  // namespace hapticd::rt
