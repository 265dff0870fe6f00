// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/safety_chain.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// How long a force loop that is to stop waits for its stages to let the force go. The force gets the time
/// that the slew limit and the low-pass need for it, with room to spare, at most kLongest_s; what is left of
/// it then is released in SafetyChain::kReleaseTicks equal steps, and the loop ends, whatever the stages do.
/// Thread: one.  Progress: wait-free.  RT: safe.
class StopBound {
 public:
  static constexpr double kLongest_s = 5;

  /// Ticks until the release. `command_n`: what is exerted when the loop is told to stop.
  static std::uint64_t ticks(const Vec3& command_n, const SafetyParameters& parameters,
                             double period_s) HAPTICD_RT {
    const double ramp_s = std::max(norm(command_n), parameters.max_force_n) / parameters.max_slew_n_per_s;
    const double filter_s = parameters.force_filter_hz > 0
                                ? std::log(kLongestForce_n / LowPass::kArrived_n) /
                                      (2 * std::numbers::pi * parameters.force_filter_hz)
                                : 0;
    const double bound_s = ramp_s + filter_s + kSpare_s;
    // also where it is not a number
    return static_cast<std::uint64_t>(std::ceil((bound_s < kLongest_s ? bound_s : kLongest_s) / period_s));
  }

  /// `planned_ns`: of the first tick of the stop.
  void begin(const Vec3& command_n, const SafetyParameters& parameters, double period_s,
             std::int64_t planned_ns) HAPTICD_RT {
    ticks_left_ = ticks(command_n, parameters, period_s);
    end_ns_ = planned_ns + static_cast<std::int64_t>(kLongest_s * 1e9);
  }

  /// Before each tick of the stop: whether it is to release the force.
  bool releases(std::int64_t planned_ns) HAPTICD_RT {
    if (ticks_left_ > 0 && planned_ns < end_ns_) {
      --ticks_left_;
      return false;
    }
    ticks_left_ = 0;
    ++released_ticks_;
    return true;
  }

  /// The force has been released.
  bool isOver() const HAPTICD_RT { return released_ticks_ >= SafetyChain::kReleaseTicks; }

 private:
  /// No box exerts more.
  static constexpr double kLongestForce_n = 1000;
  static constexpr double kSpare_s = 0.1;

  std::uint64_t ticks_left_ = 0;
  std::int64_t end_ns_ = 0;
  int released_ticks_ = 0;
};

}  // namespace hapticd::rt
