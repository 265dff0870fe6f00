// SPDX-License-Identifier: Apache-2.0
#include "rt/safety/passivity.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Largest credit relative to the energy of a linear spring under the current force; the factor allows for
/// softening laws.
constexpr double kMaxStored = 4;
/// A hand rests after staying within this distance for kRest_s: the distance exceeds encoder flicker (55 um),
/// and the time exceeds the turning point of any oscillation large enough to matter.
constexpr double kRestingPlace_m = 1e-4;
constexpr double kRest_s = 0.2;
/// Time constant of the decay of a debt while the hand rests.
constexpr double kFading_s = 0.5;
/// Largest damping that is added: about that of a hand in a light grip
/// (HandleScaleParameters::damping_n_s_per_m), which doubles it; more would hold the hand instead of calming
/// the handle.
constexpr double kMaxDamping_n_s_per_m = 5;

}  // namespace

void Passivity::updateBalance(const Input& input) HAPTICD_RT {
  const double work_j = dot(input.acted_n, input.motion_m);
  const double damped_j = input.device_damping_n_s_per_m * dot(input.motion_m, input.motion_m) /
                          std::max(input.period_s, input.motion_s);
  if (std::isfinite(work_j + damped_j)) energy_j_ += damped_j - work_j;
  if (std::isfinite(input.surface_work_j)) {
    if (input.surface_work_j > 0) {
      credit_j_ += input.surface_work_j;
    } else {
      const double taken_j = std::min(credit_j_, -input.surface_work_j);
      credit_j_ -= taken_j;
      energy_j_ += input.surface_work_j + taken_j;
    }
  }
  const double max_credit_j = norm(input.acted_n) * input.max_surface_speed_m_per_s * input.period_s;
  const double given_j = std::min(credit_j_, max_credit_j);
  credit_j_ -= given_j;
  energy_j_ += given_j;
}

void Passivity::limitCredit(const Input& input) HAPTICD_RT {
  const double largest_n = std::max({norm(input.force_n), norm(input.acted_n), input.largest_n});
  const double max_stored_j =
      input.stiffness_n_per_m > 0 ? kMaxStored * largest_n * largest_n / (2 * input.stiffness_n_per_m) : 0;
  energy_j_ = std::min(energy_j_, max_stored_j + input.stored_j);
  credit_j_ = std::min(credit_j_, max_stored_j + input.stored_j);
}

void Passivity::fadeAtRest(const Input& input) HAPTICD_RT {
  since_rest_m_ += input.motion_m;
  resting_s_ += input.period_s;
  const bool rests = input.motion_known && norm(since_rest_m_) < kRestingPlace_m;  // false if NaN
  if (!rests) {
    since_rest_m_ = {};
    resting_s_ = 0;
  }
  if (energy_j_ < 0 && resting_s_ > kRest_s) energy_j_ *= std::max(0.0, 1 - input.period_s / kFading_s);
}

Passivity::Output Passivity::apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT {
  if (!parameters.passivity_control) {
    *this = {};
    return {input.force_n};
  }
  updateBalance(input);
  limitCredit(input);
  fadeAtRest(input);

  const double speed = norm(input.velocity_m_per_s);
  if (energy_j_ >= 0 || input.force_n == Vec3{} || !(speed > 0) || !std::isfinite(speed))
    return {input.force_n};
  const double most = std::min(kMaxDamping_n_s_per_m, std::max(0.0, input.max_damping_n_s_per_m));
  // What takes the debt back within the tick; a resting hand has no motion to take it from.
  const double power_w = most * speed * speed;
  const double damping =
      power_w * input.period_s > -energy_j_ ? -energy_j_ / (speed * speed * input.period_s) : most;
  return {input.force_n - damping * input.velocity_m_per_s, damping > 0};
}

}  // namespace hapticd::rt
