// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/simulated/device_and_hand.h"

namespace hapticd::tools {

using drivers::DeviceAndHand;

/// A spring and damper computed once per period from the sampled position (the damper from the backward
/// difference), each value held for a period after `delay_ticks` periods.
struct SampledSpring {
  double stiffness_n_per_m = 500;  ///< K
  double damping_n_s_per_m = 0;    ///< B
  double period_s = 0.001;         ///< T
  int delay_ticks = 0;             ///< t_d = delay_ticks T
};

/// The rule (b + B) / (T/2 + t_d), newtons per metre, where b holds the hand's damping too.
/// Source: Colgate and Schenkel 1997 and its extension to delay, low-frequency limit.
double ruleLimit_n_per_m(const DeviceAndHand& system, const SampledSpring& spring);

/// Largest magnitude of an eigenvalue of the two-sided (never separating) linear loop; below 1: stable.
/// Coulomb friction is left out.
double spectralRadius(const DeviceAndHand& system, const SampledSpring& spring);

/// The stiffness up to which every smaller one (from 1 N/m on) is stable by spectralRadius(), to 1e-6 of it;
/// 0 where none is, `infinity` where all up to 1e7 N/m are. `spring.stiffness_n_per_m` is not read.
double eigenvalueLimit_n_per_m(const DeviceAndHand& system, SampledSpring spring);

}  // namespace hapticd::tools
