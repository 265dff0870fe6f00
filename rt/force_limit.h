// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// A force within slew limit and magnitude clamp.
struct LimitedForce {
  Vec3 force_n;          ///< within both
  Vec3 slewed_force_n;   ///< within the slew limit alone
  bool slewed = false;   ///< it differs from the force before by less than was asked for
  bool clamped = false;  ///< it is shorter than was asked for
};

/// `v`, shortened to `limit` if it is longer.  RT: safe.
inline Vec3 shortened(const Vec3& v, double length, double limit) noexcept {
  return length > limit ? (limit / length) * v : v;
}

/// One step from the force before towards an aim: no longer than `max_step_n`, and to no more than
/// `max_force_n`. A force that is over a lowered maximum is drawn inwards first; what that leaves of the step
/// goes towards the aim. All finite, limits >= 0.  RT: safe.
inline LimitedForce limitForce(const Vec3& before_n, const Vec3& aim_n, double max_step_n,
                               double max_force_n) HAPTICD_RT {
  const double before_length = norm(before_n);
  const double limit_n = std::max(max_force_n, before_length - max_step_n);
  const Vec3 from = shortened(before_n, before_length, limit_n);
  const double step_left_n = max_step_n - std::max(0.0, before_length - limit_n);

  const Vec3 step = aim_n - from;
  const double step_length = norm(step);
  const Vec3 slewed = from + shortened(step, step_length, step_left_n);
  const double slewed_length = norm(slewed);
  return {shortened(slewed, slewed_length, limit_n), slewed, step_length > step_left_n,
          slewed_length > limit_n};
}

}  // namespace hapticd::rt
