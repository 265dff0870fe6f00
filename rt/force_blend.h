// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Carries the force over from one scene, law or parameter set to the next: what the change would add at once
/// comes in evenly over the blend's duration, and never faster than k_s times the fastest surface. So the
/// surface does no more work on the hand per tick than force times the way of that surface in a tick. The
/// price is latency: a change is felt half after half the duration, and fully after all of it.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class ForceBlend {
 public:
  /// `force_n`: of the law now, finite or not; `changed`: not from the same scene, law and parameters as
  /// before; `spent_n`: how much of what a tick may change the law's own force has used up, >= 0.
  Vec3 apply(const Vec3& force_n, bool changed, const BlendParameters& parameters, double stiffness_n_per_m,
             double period_s, double spent_n = 0) HAPTICD_RT {
    const double most_n_per_s = stiffness_n_per_m * parameters.max_surface_speed_m_per_s;
    if (changed) {
      offset_n_ = last_n_ - force_n;
      rate_n_per_s_ = std::min(most_n_per_s, norm(offset_n_) / std::max(parameters.duration_s, period_s));
    }
    const double length = norm(offset_n_);
    const double step = std::min(rate_n_per_s_ * period_s, std::max(0.0, most_n_per_s * period_s - spent_n));
    // also where a length is not a number
    offset_n_ = length > step && parameters.duration_s > 0 ? ((length - step) / length) * offset_n_ : Vec3{};
    last_n_ = force_n + offset_n_;
    if (!isFinite(last_n_)) reset();
    return force_n + offset_n_;
  }

  /// The next force comes at once.
  void reset() HAPTICD_RT {
    offset_n_ = {};
    last_n_ = {};
  }

 private:
  Vec3 last_n_;
  Vec3 offset_n_;
  double rate_n_per_s_ = 0;
};

}  // namespace hapticd::rt
