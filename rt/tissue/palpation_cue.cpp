// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/palpation_cue.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr double kFullTurn_rad = 2 * std::numbers::pi;
/// Fastest turn of the direction.
constexpr double kTurn_rad_per_s = kFullTurn_rad;
/// Shorter projections onto the surface have no usable direction.
constexpr double kMinProjection = 0.1;

Vec3 alongSurface(const Vec3& v, const Vec3& normal) noexcept {
  return v - dot(v, normal) * normal;
}

/// Any unit vector along the surface.
Vec3 anyTangent(const Vec3& normal) noexcept {
  const Vec3 side = cross(normal, std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
  return (1 / norm(side)) * side;
}

}  // namespace

void PalpationCue::turn(const Input& input) HAPTICD_RT {
  if (input.normal_in_world == Vec3{}) return;
  const Vec3 motion = alongSurface(input.velocity_m_per_s_in_world, input.normal_in_world);
  const double speed = norm(motion);
  const Vec3 kept = alongSurface(direction_, input.normal_in_world);
  Vec3 aim;
  if (speed > kMinSpeed_m_per_s && std::isfinite(speed)) {
    aim = (1 / speed) * motion;
  } else {
    aim = norm(kept) > kMinProjection ? (1 / norm(kept)) * kept : anyTangent(input.normal_in_world);
  }
  if (!(amplitude_n_ > 0) || direction_ == Vec3{}) {
    direction_ = aim;
    return;
  }
  // A vibration has no sign: it turns to the nearer of the two directions.
  if (dot(aim, direction_) < 0) aim = -aim;
  const Vec3 rest = aim - direction_;
  const double left = norm(rest);
  const double step = kTurn_rad_per_s * input.period_s;
  const Vec3 turned = left > step ? direction_ + (step / left) * rest : aim;
  direction_ = (1 / norm(turned)) * turned;
}

Vec3 PalpationCue::apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT {
  const bool requested = input.allowed && input.amplitude_n > 0 && input.frequency_hz > 0;
  if (!requested && !(amplitude_n_ > 0)) {
    phase_rad_ = 0;
    return {};
  }
  if (requested) frequency_hz_ = std::min(input.frequency_hz, kMaxFrequency_hz);
  if (input.allowed) turn(input);
  const double slew_n_per_s = kSlewShare * parameters.max_slew_n_per_s;
  const double ramp_n_per_s = std::min(kMaxForce_n / kRamp_s, slew_n_per_s / 4);
  const double step_n = ramp_n_per_s * input.period_s;
  const double aim_n = requested ? std::min(input.amplitude_n, kMaxForce_n) : 0;
  const double most_n = std::min(kMaxShare * input.contact_force_n,
                                 (slew_n_per_s - ramp_n_per_s) / (kFullTurn_rad * frequency_hz_));
  amplitude_n_ = std::clamp(aim_n, amplitude_n_ - step_n, amplitude_n_ + step_n);
  amplitude_n_ = input.allowed && std::isfinite(most_n) ? std::clamp(amplitude_n_, 0.0, most_n) : 0;
  phase_rad_ = std::fmod(phase_rad_ + kFullTurn_rad * frequency_hz_ * input.period_s, kFullTurn_rad);
  return amplitude_n_ * std::sin(phase_rad_) * alongSurface(direction_, input.normal_in_world);
}

}  // namespace hapticd::rt
