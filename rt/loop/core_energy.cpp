// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "rt/laws/law_table.h"
#include "rt/loop/haptic_core.h"

// What the hand gave and received: HapticCore's part of the account that passivity control keeps.
namespace hapticd::rt {

/// Computes the work that fixtures did on the HIP by moving with the surface, growing or changing their
/// stiffness.
double HapticCore::fixtureWork_j(const Before& before, const Change& change, const Input& input,
                                 const Vec3& hip_motion_m) const HAPTICD_RT {
  const Before& now = state_.before;
  if (!change.inputs) return now.fixture_changes_j + now.standoff_power_w * input.period_s;
  const Vec3 twice_mean = now.standoff_force_n_in_world + before.standoff_force_n_in_world;
  return now.fixture_changes_j + now.standoff_j - before.standoff_j + dot(twice_mean, hip_motion_m) / 2;
}

/// Computes the input of passivity control for this tick. The energy of a spring that is exerted with the
/// gain g is g U. A change of it beyond the
/// work of the HIP (F . dx with the mean force over the tick) was caused by the scene or by the gain: a
/// surface moved.
SafetyChain::Motion HapticCore::motionSince(const Before& before, const Change& change, const Input& input,
                                            const Evaluation& evaluation, const Tick& tick) const HAPTICD_RT {
  const Vec3& surface_velocity_m_per_s = evaluation.sample.surface_velocity_m_per_s_in_world;
  const HandleScaleParameters& scale = input.start.handle;
  const double to_hand = 1 / scale.motion_scale;
  const double stiffness = state_.before.stiffness_n_per_m;
  const double gain = state_.before.gain;
  const Vec3 hip_motion_m = input.handle.position_m_in_world - before.hip_m_in_world;
  SafetyChain::Motion motion;
  motion.known = true;
  motion.motion_s = static_cast<double>(input.handle.time_ns - before.handle_ns) * 1e-9;
  motion.hand_m = to_hand * hip_motion_m;
  motion.velocity_m_per_s = to_hand * input.handle.velocity_m_per_s_in_world;
  motion.stiffness_n_per_m =
      gain * evaluation.contact.secant_n_per_m * scale.motion_scale * scale.force_scale;
  motion.device_damping_n_s_per_m = scale.device_damping_n_s_per_m;
  motion.max_surface_speed_m_per_s = to_hand * kFastestSurface_m_per_s;
  motion.delay_s = state_.latency.delay_s(input.handle);
  motion.stored_j = state_.before.mode_gain * (state_.before.fixture_j + state_.before.guidance_j) *
                    scale.force_scale * to_hand;
  if (tick.stiffness_n_per_m > 0) {
    const Before& now = state_.before;
    const double stiffness_before = before.stiffness_n_per_m > 0 ? before.stiffness_n_per_m : stiffness;
    const Vec3 twice_mean = now.law_force_n_in_world + before.law_force_n_in_world;
    const double stored = now.law_j - before.law_j;
    const double of_hip = -dot(twice_mean, hip_motion_m) / 2;
    const double of_stiffness = stiffness > 0 ? dot(now.law_force_n_in_world, now.law_force_n_in_world) /
                                                    (2 * stiffness) * (1 - stiffness_before / stiffness)
                                              : 0;
    const double of_surface =
        change.surface ? stored - of_hip
                       : dot(twice_mean, surface_velocity_m_per_s) / 2 * input.period_s + of_stiffness;
    double work_j = before.gain * of_surface + (gain - before.gain) * now.law_j;
    if (now.fixture_j > 0 || before.fixture_j > 0) {
      work_j += before.mode_gain * fixtureWork_j(before, change, input, hip_motion_m) +
                (now.mode_gain - before.mode_gain) * now.fixture_j;
    }
    motion.surface_work_j = work_j * scale.force_scale * to_hand;
    if (hasProxy(laws_.law())) motion.stored_j += gain * now.law_j * scale.force_scale * to_hand;
  }
  return motion;
}

/// Returns whether the hand has got more energy from the box than it gave, by more than the contact at its
/// limits can store: under the largest force F a spring F^2 / (2 k_s), and a law without a proxy, which acts
/// all over its radius, F D_thresh. Besides, a force that arrives with the known delay may push a hand that
/// has turned meanwhile.
bool HapticCore::isInDebt(const Input& input, const Tick& tick) HAPTICD_RT {
  constexpr double kHandSpeed_m_per_s = 1;
  const LiveParameters& parameters = input.directive.parameters;
  const HandleScaleParameters& scale = input.start.handle;
  const double max_n = parameters.safety.max_force_n;
  const double spring_j =
      max_n * max_n / (2 * scale.motion_scale * scale.force_scale * tick.stiffness_n_per_m);
  const double stored_j = hasProxy(laws_.law())
                              ? spring_j
                              : std::max(spring_j, max_n * parameters.force.radius_m / scale.motion_scale);
  const double allowed_j = std::max(stored_j, EnergyDebt::kMin_j) +
                           max_n * kHandSpeed_m_per_s * state_.latency.delay_s(input.handle);
  const bool at_zero = state_.supervisor.gain() == 0 && state_.safety.lastForce_n_in_world() == Vec3{};
  return state_.debt.follow(state_.safety.energy_j(), allowed_j, at_zero, input.directive.engage_request,
                            input.period_s);
}

}  // namespace hapticd::rt
