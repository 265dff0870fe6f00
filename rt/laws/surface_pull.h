// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/base/vec3.h"
#include "rt/laws/force_blend.h"

namespace hapticd::rt {

/// What became of the place that the spring of the law `surface` pulls to, from the last tick to this one.
/// Metres in the camera's frame.
struct PullChange {
  Vec3 pulled_before_m;  ///< where the spring pulled to
  Vec3 goal_before_m;    ///< where it was to pull to: the proxy, or the HIP where the surface had vanished
  Vec3 goal_m;           ///< where it is to pull to now
  double hip_displacement_m;  ///< >= 0
  Vec3 normal;                ///< the surface may have moved along it; zero: it has not moved
  bool was_held;              ///< the proxy was in contact
  bool is_curved;             ///< the surface that the proxy slides along may be
  bool is_new_frame;
  double period_s;
};

/// Returns the place that the spring pulls to. It is the goal, as far as the motion of the HIP and of the
/// surface explains that. Where the goal jumps because something else holds the proxy, the place moves over:
/// at kFastestSurface_m_per_s after a motion of the hand, and after one of the scene, which a new frame or
/// the extrapolation of the last one shows, slowly enough for a hand to follow. `speed_m_per_s` is kept from
/// tick to tick.
/// RT: safe.
inline Vec3 moveOver(const PullChange& change, double& speed_m_per_s) noexcept {
  constexpr double kMoveOver_s = 0.13;  // from 90 to 10 % in three frames
  constexpr double kLeastSpeed_m_per_s = 0.02;
  constexpr double kSlant = 0.3;  // displacement along a surface that comes over the HIP, per outwards
  constexpr double kHand_m_per_s = 0.05;  // a hand that moves faster left the contact itself
  constexpr double kCurved = 3;  // largest ratio of the proxy's displacement to the HIP's on a curved surface
  const double furthest_m = kFastestSurface_m_per_s * change.period_s;
  const Vec3 rest = change.pulled_before_m - change.goal_m;
  const Vec3 rest_before = change.pulled_before_m - change.goal_before_m;
  const Vec3 moved = change.goal_m - change.goal_before_m;
  const double outwards_m = dot(moved, change.normal);
  const Vec3 along = moved - outwards_m * change.normal;
  double explained_m = (change.is_curved ? kCurved : 1) * change.hip_displacement_m + furthest_m;
  if (!change.was_held) explained_m += kSlant * std::abs(outwards_m);
  const bool jumps = norm(along) > explained_m;
  if (jumps) {
    const bool by_hand = !change.is_new_frame && change.hip_displacement_m > kHand_m_per_s * change.period_s;
    speed_m_per_s =
        by_hand ? kFastestSurface_m_per_s : std::max(norm(rest) / kMoveOver_s, kLeastSpeed_m_per_s);
  }
  const Vec3 left = jumps || norm(rest) < norm(rest_before) ? rest : rest_before;
  const double length = norm(left);
  // What the surface moves on its own counts as well.
  const double spent_m = jumps ? 0 : std::max(0.0, norm(along) - change.hip_displacement_m);
  const double step = std::min(std::max(0.0, furthest_m - spent_m),
                               speed_m_per_s * change.period_s + change.hip_displacement_m);
  return length > step ? change.goal_m + (1 - step / length) * left : change.goal_m;
}

}  // namespace hapticd::rt
