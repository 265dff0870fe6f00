// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// How much force a device may exert, given how warm it is. Heat is a first-order mean of the squared force
/// (the losses of a motor go with the square of its current):  dh/dt = (F^2 - h) / tau.  While h is below
/// nine tenths of F_c^2 the device may exert its peak; from there on the limit falls linearly to F_c at h =
/// F_c^2. As F <= F_c there, h never rises above F_c^2. Thread: one.  Progress: wait-free.  RT: safe.
class ThermalLimit {
 public:
  /// The largest force of the next tick, N, in min(F_c, F_peak) .. F_peak.
  double limit_n(double peak_force_n, double continuous_force_n) const HAPTICD_RT {
    if (peak_force_n <= continuous_force_n) return peak_force_n;
    const double warmth = heat_n2_ / (continuous_force_n * continuous_force_n);
    const double share = std::clamp((1 - warmth) / (1 - kWarm), 0.0, 1.0);
    return continuous_force_n + share * (peak_force_n - continuous_force_n);
  }

  /// `force_n`: magnitude that was exerted over the period.
  void heat(double force_n, double time_constant_s, double period_s) HAPTICD_RT {
    heat_n2_ += -std::expm1(-period_s / time_constant_s) * (force_n * force_n - heat_n2_);
    if (heat_n2_ < kCold_n2) heat_n2_ = 0;
  }

  /// Mean of the squared force, N^2.
  double heat_n2() const noexcept { return heat_n2_; }

 private:
  static constexpr double kWarm = 0.9;
  /// Below it the mean would shrink into numbers that a processor computes slowly with, and stay there. Far
  /// less than the last bit of any heat that limits a force.
  static constexpr double kCold_n2 = 1e-30;
  double heat_n2_ = 0;
};

}  // namespace hapticd::rt
