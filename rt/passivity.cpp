#include "rt/passivity.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Slower hands are at rest: dividing by their speed would only amplify noise.
constexpr double kSlowest_m_per_s = 1e-3;
/// Of the energy of a linear spring under the force of the moment: room for laws that soften.
constexpr double kMostStored = 4;
/// Time constant by which a debt is forgiven that damping could not collect.
constexpr double kForgiving_s = 0.5;

}  // namespace

void Passivity::book(const Input& input) HAPTICD_RT {
  const double work_j = dot(input.exerted_n, input.motion_m);
  const double damped_j =
      input.device_damping_n_s_per_m * dot(input.motion_m, input.motion_m) / input.period_s;
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
  const double most_j = norm(input.exerted_n) * input.max_surface_speed_m_per_s * input.period_s;
  const double given_j = std::min(credit_j_, most_j);
  credit_j_ -= given_j;
  energy_j_ += given_j;
}

Passivity::Output Passivity::apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT {
  book(input);
  const double force2_n2 = std::max(dot(input.force_n, input.force_n), dot(input.exerted_n, input.exerted_n));
  if (!parameters.passivity_control || force2_n2 == 0 || !(input.stiffness_n_per_m > 0)) {
    reset();
    return {input.force_n};
  }
  if (energy_j_ < 0) energy_j_ -= input.period_s / kForgiving_s * energy_j_;
  const double most_stored_j = kMostStored * force2_n2 / (2 * input.stiffness_n_per_m);
  energy_j_ = std::min(energy_j_, most_stored_j);
  credit_j_ = std::min(credit_j_, most_stored_j);

  const double speed2 = dot(input.velocity_m_per_s, input.velocity_m_per_s);
  if (energy_j_ >= 0 || !(speed2 > kSlowest_m_per_s * kSlowest_m_per_s) || !std::isfinite(speed2)) {
    return {input.force_n};
  }
  const double damping =
      std::min(-energy_j_ / (speed2 * input.period_s), parameters.passivity_max_damping_n_s_per_m);
  return {input.force_n - damping * input.velocity_m_per_s, damping > 0};
}

}  // namespace hapticd::rt
