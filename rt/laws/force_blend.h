// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Speed of the fastest surface that a person should be able to follow, as of another hand in the scene: the
/// blend changes the force by at most k_s times this per second, 0.25 N per tick at 500 N/m.
inline constexpr double kFastestSurface_m_per_s = 0.5;

/// Fastest growth of what pushes a hand that presses on it, however that came to be there: it appeared, was
/// moved, or became larger or stiffer.
inline constexpr double kMaxGrowth_m_per_s = 0.005;

/// Carries the force over from one scene, law or parameter set to the next: the step that the change would
/// cause is blended in evenly over the blend's duration, and never faster than k_s times the speed of the
/// fastest surface. The surface therefore does no more work on the hand per tick than force times its
/// displacement in a tick. The cost is latency: half of a change has arrived after half the duration, all of
/// it after the whole duration.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class ForceBlend {
 public:
  /// Returns the blended force. `force_n`: the law's force, finite or not; `changed`: scene, law or
  /// parameters differ from the previous call; `spent_n` (>= 0): part of the change allowed per tick that the
  /// law's own force has used up.
  Vec3 apply(const Vec3& force_n, bool changed, const BlendParameters& parameters, double stiffness_n_per_m,
             double period_s, double spent_n = 0) HAPTICD_RT {
    const double max_n_per_s = stiffness_n_per_m * kFastestSurface_m_per_s;
    if (changed) {
      offset_n_ = last_n_ - force_n;
      rate_n_per_s_ = std::min(max_n_per_s, norm(offset_n_) / std::max(parameters.duration_s, period_s));
    }
    const double length = norm(offset_n_);
    const double step = std::min(rate_n_per_s_ * period_s, std::max(0.0, max_n_per_s * period_s - spent_n));
    // also if a length is NaN
    offset_n_ = length > step && parameters.duration_s > 0 ? ((length - step) / length) * offset_n_ : Vec3{};
    last_n_ = force_n + offset_n_;
    if (!isFinite(last_n_)) reset();
    return force_n + offset_n_;
  }

  /// Forgets the previous force, so that the next one is not blended.
  void reset() HAPTICD_RT {
    offset_n_ = {};
    last_n_ = {};
  }

 private:
  Vec3 last_n_;
  Vec3 offset_n_;
  double rate_n_per_s_ = 0;
};

/// Lets the force of a law begin. After another law it grows from nothing, as slowly as a surface, while the
/// force of the old one leaves (LeavingLaw). After a pause in which nothing was exerted, it begins where the
/// HIP is free of it: a law without a proxy knows no depth to begin at.
///
/// Thread: one.  RT: safe.
class LawEntry {
 public:
  /// The law acts.
  LawEntry() = default;
  static LawEntry slowly() noexcept { return {0, false}; }
  static LawEntry outside() noexcept { return {0, true}; }

  /// Returns the share of the law's force to exert in this tick, 0..1. `force_n` (>= 0): all of it, of
  /// springs of `stiffness_n_per_m`.
  double advance(double force_n, double stiffness_n_per_m, double period_s) noexcept {
    if (!(force_n > 0)) {
      *this = {};
    } else if (!waits_) {
      share_ = std::min(1.0, share_ + kMaxGrowth_m_per_s * stiffness_n_per_m * period_s / force_n);
    }
    return share_;
  }

 private:
  LawEntry(double share, bool waits) noexcept : share_(share), waits_(waits) {}

  double share_ = 1;
  bool waits_ = false;
};

}  // namespace hapticd::rt
