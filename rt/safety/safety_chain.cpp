// SPDX-License-Identifier: Apache-2.0
#include "rt/safety/safety_chain.h"

#include <algorithm>

#include "rt/safety/force_limit.h"

namespace hapticd::rt {
SafetyChain::Output SafetyChain::apply(const Vec3& force_n_in_world, const SafetyParameters& parameters,
                                       double period_s, const Motion& motion) HAPTICD_RT {
  Output out;
  releasing_ = false;
  // Not a stage of its own: a value that is not finite must not enter the state of the stages. The length is
  // checked as well, because it can overflow where the components do not.
  out.not_finite = !std::isfinite(norm(force_n_in_world));
  const Vec3 checked = out.not_finite ? Vec3{} : force_n_in_world;

  const Passivity::Output passive = passivity_.apply(
      {checked, commands_.acting_n(motion.delay_s, period_s), motion.hand_m, motion.velocity_m_per_s,
       motion.surface_work_j, motion.stiffness_n_per_m, motion.device_damping_n_s_per_m,
       motion.max_surface_speed_m_per_s, period_s, commands_.largest_n(motion.delay_s, period_s),
       motion.max_damping_n_s_per_m, motion.known, motion.motion_s, motion.stored_j},
      parameters);
  out.passivity_acted = passive.acted;
  out.passive_n_in_world = passive.force_n;
  Vec3 aim = low_pass_.apply(passive.force_n, parameters.force_filter_hz, period_s);
  out.filtered_n_in_world = aim;
  const bool has_cue = !(motion.cue_n_in_world == Vec3{}) && !out.not_finite;
  if (has_cue) aim += motion.cue_n_in_world;  // a sum with zero would change the sign of -0

  const Vec3 own_aim = aim;
  const Vec3 external = allowedExternal_n(parameters, period_s, motion);
  const bool has_external = !(external == Vec3{}) && !out.not_finite;
  if (has_external) aim += external;

  const double allowed_n = thermal_.limit_n(parameters.max_force_n, parameters.continuous_force_n);
  const double step_n = parameters.max_slew_n_per_s * period_s;
  const LimitedForce limited = limitForce(last_, aim, step_n, allowed_n);
  out.slewed_n_in_world = limited.slewed_force_n;
  out.slew_limited = limited.slewed;
  out.magnitude_clamped = limited.clamped;
  out.thermally_limited = allowed_n < parameters.max_force_n;
  const Vec3 force = isFinite(limited.force_n) ? limited.force_n : Vec3{};
  // What would be commanded without the external force, which is the rest.
  const bool is_own = !has_external && last_own_ == last_;
  const Vec3 own = is_own ? force : limitForce(last_own_, own_aim, step_n, allowed_n).force_n;
  command(force, isFinite(own) ? own : Vec3{}, parameters, period_s);
  out.force_n_in_world = last_;
  return out;
}

Vec3 SafetyChain::allowedExternal_n(const SafetyParameters& parameters, double period_s,
                                    const Motion& motion) HAPTICD_RT {
  const double power_w = parameters.max_external_power_w;
  external_budget_.follow(external_commands_.acting_n(motion.delay_s, period_s), motion.hand_m, power_w,
                          period_s);
  const Vec3& force = motion.external_n_in_world;
  const double length_n = norm(force);
  if (!std::isfinite(length_n) || !(length_n > 0)) return {};
  const double most_n = parameters.max_external_force_n;
  const Vec3 shortened = length_n > most_n ? (most_n / length_n) * force : force;
  return external_budget_.limited(shortened, motion.velocity_m_per_s);
}

SafetyChain::Output SafetyChain::release(const SafetyParameters& parameters, double period_s) HAPTICD_RT {
  if (!releasing_) {
    releasing_ = true;
    release_ticks_left_ = kReleaseTicks;
    release_step_ = (1.0 / kReleaseTicks) * last_;
    own_release_step_ = (1.0 / kReleaseTicks) * last_own_;
  }
  --release_ticks_left_;
  low_pass_.apply({}, 0, period_s);
  const bool goes_on = release_ticks_left_ > 0;
  command(goes_on ? last_ - release_step_ : Vec3{}, goes_on ? last_own_ - own_release_step_ : Vec3{},
          parameters, period_s);
  release_ticks_left_ = std::max(release_ticks_left_, 0);
  Output out;
  out.slewed_n_in_world = out.force_n_in_world = last_;
  return out;
}

void SafetyChain::restart() HAPTICD_RT {
  last_ = {};
  last_own_ = {};
  low_pass_.apply({}, 0, 1);
  commands_ = {};
  external_commands_ = {};
  releasing_ = false;
}

void SafetyChain::command(const Vec3& force_n, const Vec3& own_n, const SafetyParameters& parameters,
                          double period_s) HAPTICD_RT {
  last_ = force_n;
  last_own_ = own_n;
  commands_.add(own_n);
  external_commands_.add(force_n - own_n);
  thermal_.heat(norm(force_n), parameters.thermal_time_s, period_s);
}

}  // namespace hapticd::rt
