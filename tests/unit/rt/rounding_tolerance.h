// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/parameters.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd::test {

/// Returns how far the law's force may deviate from an exact evaluation by rounding alone, in newtons.
/// Positions of a few metres are rounded to about 1e-15 m, which changes the direction of a spring of length
/// s by 1e-15 / s; s is at least 1e-6 m here (1e-8 N for k D = 20 N; all other rounding is much smaller).
inline double roundingTolerance_n(const rt::SpringParameters& parameters) {
  return 1e-9 * parameters.stiffness_n_per_m * parameters.radius_m;
}

/// Returns whether the choice of points depends on distances that differ by less than rounding (1e-12 m):
/// another choice is equally correct.
inline bool isUndecided(const tools::SpringOracle& oracle) {
  constexpr double kIndistinguishable_m = 1e-12;
  return oracle.radiusMargin_m() < kIndistinguishable_m || oracle.rankMargin_m() < kIndistinguishable_m;
}

}  // namespace hapticd::test
