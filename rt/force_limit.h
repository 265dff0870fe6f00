// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// A force after slew limit and magnitude clamp.
struct LimitedForce {
  Vec3 force_n;          ///< after both limits
  Vec3 slewed_force_n;   ///< after the slew limit alone
  bool slewed = false;   ///< the slew limit shortened the step
  bool clamped = false;  ///< the clamp shortened the force
};

/// Returns `v`, shortened to `limit` if its `length` is greater.  RT: safe.
inline Vec3 shortened(const Vec3& v, double length, double limit) noexcept {
  return length > limit ? (limit / length) * v : v;
}

/// Takes one step from the previous force towards `aim_n`, no longer than `max_step_n` and to a force of at
/// most `max_force_n`. A force above a lowered maximum first shrinks; what remains of the step goes towards
/// the aim. All inputs finite, limits >= 0.  RT: safe.
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
