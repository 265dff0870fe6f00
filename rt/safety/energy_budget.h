// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Bounds the energy that a force of unknown origin gives to the hand: to a reserve, which a power fills
/// again, and what the hand gave to the force. So a passive spring behind the force is not limited, and one
/// that is unstable moves the hand with no more than the power.
///
/// A tick decides by a velocity that its force will change, and a command acts later than it was given, so
/// the budget can be overdrawn. A force whose budget is overdrawn by the reserve is zero.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class EnergyBudget {
 public:
  static constexpr double kReserve_j = 0.02;
  /// Of what the hand gave, this much is kept: the energy of a spring of 500 N/m under 10 N.
  static constexpr double kMost_j = 0.1;

  /// Accounts for the work of the force that acted on the hand during the last tick.
  /// `motion_m`: displacement of the hand meanwhile. `power_w` >= 0, `period_s` > 0.
  void follow(const Vec3& acted_n, const Vec3& motion_m, double power_w, double period_s) HAPTICD_RT {
    const double work_j = dot(acted_n, motion_m);
    if (std::isfinite(work_j)) left_j_ = std::min(left_j_ - work_j, kMost_j);
    if (left_j_ < kReserve_j) left_j_ = std::min(left_j_ + power_w * period_s, kReserve_j);
  }

  /// Returns the force without that part along the velocity of the hand which would give out in less than
  /// kSpending_s what is left, and less of it all where the budget is overdrawn. `force_n`: finite.
  Vec3 limited(const Vec3& force_n, const Vec3& velocity_m_per_s) const HAPTICD_RT {
    const Vec3 force = std::clamp(1 + left_j_ / kReserve_j, 0.0, 1.0) * force_n;
    const double speed2 = dot(velocity_m_per_s, velocity_m_per_s);
    const double excess_w = dot(force, velocity_m_per_s) - std::max(0.0, left_j_) / kSpending_s;
    if (!(excess_w > 0) || !(speed2 > 0)) return force;
    return force - (excess_w / speed2) * velocity_m_per_s;
  }

 private:
  /// Short enough that a full reserve lets a power of several watts pass, long beside a tick.
  static constexpr double kSpending_s = 0.004;

  double left_j_ = kReserve_j;
};

}  // namespace hapticd::rt
