// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// First-order low-pass filter of a force: y += (1 - exp(-2 pi f T)) (x - y). It delays slow changes by 1 /
/// (2 pi f). Once the output is within kArrived_n of the input it equals the input. The output is never
/// longer than the longest input so far.
/// Thread: one.  Progress: wait-free.  RT: safe.
class LowPass {
 public:
  /// Far below what any device can exert; without it, the output would approach the input but never equal it.
  static constexpr double kArrived_n = 1e-9;

  /// Returns the filtered force. `force_n`: finite; `cutoff_hz`: 0 disables the filter; `period_s`: time
  /// since the previous call, > 0.
  Vec3 apply(const Vec3& force_n, double cutoff_hz, double period_s) HAPTICD_RT {
    if (!(cutoff_hz > 0)) return last_n_ = force_n;
    const double share = -std::expm1(-2 * std::numbers::pi * cutoff_hz * period_s);
    last_n_ = last_n_ + share * (force_n - last_n_);
    if (norm(force_n - last_n_) < kArrived_n) last_n_ = force_n;
    return last_n_;
  }

 private:
  Vec3 last_n_;
};

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

/// Limits the force by the temperature of the device. Heat is modelled as a first-order mean of the squared
/// force, because the losses of a motor are proportional to the square of its current:  dh/dt = (F^2 - h) /
/// tau.  While h is below nine tenths of F_c^2 the device may exert its peak force; above, the limit falls
/// linearly to F_c at h = F_c^2. Since F <= F_c there, h never exceeds F_c^2.
/// Thread: one.  Progress: wait-free.  RT: safe.
class ThermalLimit {
 public:
  /// Returns the largest force of the next tick in N, within min(F_c, F_peak) .. F_peak.
  double limit_n(double peak_force_n, double continuous_force_n) const HAPTICD_RT {
    if (peak_force_n <= continuous_force_n) return peak_force_n;
    const double warmth = heat_n2_ / (continuous_force_n * continuous_force_n);
    const double share = std::clamp((1 - warmth) / (1 - kWarm), 0.0, 1.0);
    return continuous_force_n + share * (peak_force_n - continuous_force_n);
  }

  /// Adds the force of one period. `force_n`: magnitude exerted during the period.
  void heat(double force_n, double time_constant_s, double period_s) HAPTICD_RT {
    heat_n2_ += -std::expm1(-period_s / time_constant_s) * (force_n * force_n - heat_n2_);
    if (heat_n2_ < kCold_n2) heat_n2_ = 0;
  }

  /// Returns the mean of the squared force in N^2.
  double heat_n2() const noexcept { return heat_n2_; }

 private:
  static constexpr double kWarm = 0.9;
  /// Lower values are set to zero, because the mean would become denormal, which is slow, and stay so. This
  /// is far below the last bit of any heat that limits a force.
  static constexpr double kCold_n2 = 1e-30;
  double heat_n2_ = 0;
};

}  // namespace hapticd::rt
