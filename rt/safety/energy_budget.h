// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Bounds the energy that a force of unknown origin gives to the hand: a reserve that fills with a power.
/// What the hand gives to the force fills it too, so that a passive spring behind the force is hardly
/// limited, and one that is unstable moves the hand with no more than the power. Thread: one.  Progress:
/// wait-free.  RT: safe.
class EnergyBudget {
 public:
  static constexpr double kReserve_j = 0.02;
  static constexpr double kSpending_s = 0.02;

  /// Accounts for the work of the force that acted on the hand during the last tick.
  /// `motion_m`: displacement of the hand meanwhile. `power_w` >= 0, `period_s` > 0.
  void follow(const Vec3& acted_n, const Vec3& motion_m, double power_w, double period_s) HAPTICD_RT {
    const double work_j = dot(acted_n, motion_m);
    if (std::isfinite(work_j)) left_j_ += power_w * period_s - work_j;
    left_j_ = std::min(left_j_, kReserve_j + power_w * kSpending_s);
  }

  /// Returns the force without that part along the velocity of the hand which would give out in less than
  /// kSpending_s what is left. `force_n`: finite.
  Vec3 limited(const Vec3& force_n, const Vec3& velocity_m_per_s) const HAPTICD_RT {
    const double speed2 = dot(velocity_m_per_s, velocity_m_per_s);
    const double excess_w = dot(force_n, velocity_m_per_s) - std::max(0.0, left_j_) / kSpending_s;
    if (!(excess_w > 0) || !(speed2 > 0)) return force_n;
    return force_n - (excess_w / speed2) * velocity_m_per_s;
  }

  double left_j() const noexcept { return left_j_; }

 private:
  double left_j_ = kReserve_j;
};

}  // namespace hapticd::rt
