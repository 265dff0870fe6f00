// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/realtime_safe.h"

namespace hapticd::rt {

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
