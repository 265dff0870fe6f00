// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/spacemouse_motion.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hapticd::drivers {
namespace {

/// Returns the fraction of the full speed, -1..1.
double shareOf(int deflection) {
  constexpr double kRange = SpaceMouseMotion::kFullDeflection - SpaceMouseMotion::kDeadZone;
  const int beyond = std::max(0, std::abs(deflection) - SpaceMouseMotion::kDeadZone);
  return std::copysign(std::min(1.0, beyond / kRange), deflection);
}

}  // namespace

void SpaceMouseMotion::step(const SpaceMouseState& cap, double dt_s) {
  const double step_s = std::clamp(dt_s, 0.0, kLongestStepS);
  const auto& [right, towards, down] = cap.translation;
  stepAxis(&rt::Vec3::x, right, step_s);
  stepAxis(&rt::Vec3::y, -down, step_s);
  stepAxis(&rt::Vec3::z, towards, step_s);
}

void SpaceMouseMotion::stepAxis(double rt::Vec3::*axis, int deflection, double dt_s) {
  const double speed = full_speed_m_per_s_ * shareOf(deflection);
  const double target = position_.*axis + speed * dt_s;
  position_.*axis = std::clamp(target, -reach_m_, reach_m_);
  velocity_.*axis = position_.*axis == target ? speed : 0;
}

}  // namespace hapticd::drivers
