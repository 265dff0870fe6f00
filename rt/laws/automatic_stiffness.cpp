// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/automatic_stiffness.h"

#include <algorithm>
#include <cmath>

#include "rt/laws/force_blend.h"

namespace hapticd::rt {

StiffnessRules StiffnessRules::of(const LiveParameters& parameters, const HandleScaleParameters& handle,
                                  double stability_n_per_m, const SurfaceNoise& surface) noexcept {
  const SafetyParameters& safety = parameters.safety;
  StiffnessRules rules;
  rules.surface = surface;
  rules.ceiling_n_per_m = parameters.force.stiffness_ceiling_n_per_m;
  rules.stability_n_per_m = stability_n_per_m;
  rules.device_n_per_m =
      safety.continuous_force_n / kPenetration_m / (handle.motion_scale * handle.force_scale);
  if (surface.noise_m > 0)
    rules.noise_n_per_m = kNoticeable * kTypicalForce_n / (surface.noise_m * handle.force_scale);
  if (surface.step_m > 0 && surface.frame_period_s > 0) {
    rules.slew_n_per_m =
        safety.max_slew_n_per_s * surface.frame_period_s / (surface.step_m * handle.force_scale);
  }
  return rules;
}

StiffnessRules::Limit StiffnessRules::least(double without_noise_n_per_m) const noexcept {
  const bool noise_is_known = surface.frames > 0;
  Limit least{StiffnessBound::ceiling, ceiling_n_per_m};
  for (const Limit& limit :
       {Limit{StiffnessBound::stability, stability_n_per_m}, Limit{StiffnessBound::device, device_n_per_m},
        Limit{StiffnessBound::noise, noise_is_known ? noise_n_per_m : without_noise_n_per_m},
        Limit{StiffnessBound::slew, slew_n_per_m}}) {
    if (limit.n_per_m < least.n_per_m) least = limit;
  }
  return least;
}

double AutomaticStiffness::begin(const LiveParameters& configured, double loaded_n,
                                 double period_s) HAPTICD_RT {
  const bool was_on = on_;
  on_ = configured.force.stiffness_is_automatic;
  if (on_ && was_on) return stiffness_n_per_m_;
  double aim = configured.force.stiffness_n_per_m;
  if (on_) {
    aim = std::min(kModestStiffness_n_per_m, configured.force.stiffness_ceiling_n_per_m);
    // Switching over must not make a surface in contact stiffer.
    if (stiffness_n_per_m_ > 0) aim = std::min(aim, stiffness_n_per_m_);
  }
  const double step = kMaxGrowth_m_per_s * period_s * stiffness_n_per_m_ * stiffness_n_per_m_ / loaded_n;
  stiffness_n_per_m_ = stiffness_n_per_m_ > 0 && loaded_n > 0 && std::isfinite(aim)
                           ? std::clamp(aim, stiffness_n_per_m_ - step, stiffness_n_per_m_ + step)
                           : aim;
  // Until it has arrived, it counts as configured.
  on_ = on_ && stiffness_n_per_m_ <= aim;
  return stiffness_n_per_m_;
}

void AutomaticStiffness::follow(const StiffnessRules& rules, bool in_contact, double period_s) HAPTICD_RT {
  rules_ = rules;
  if (!on_) return;
  // Without knowing the noise, nothing justifies more than the stiffness in effect or the modest one.
  const StiffnessRules::Limit least = rules.least(std::max(stiffness_n_per_m_, kModestStiffness_n_per_m));
  bound_ = least.bound;
  const double highest =
      in_contact ? stiffness_n_per_m_ : stiffness_n_per_m_ * (1 + kStiffnessRise_per_s * period_s);
  const double lowest = stiffness_n_per_m_ * (1 - std::min(1.0, kStiffnessFall_per_s * period_s));
  stiffness_n_per_m_ = std::clamp(least.n_per_m, lowest, highest);
}

}  // namespace hapticd::rt
