// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/hid/spacemouse_report.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// A position moved by a SpaceMouse: its deflection is a velocity, which is integrated starting from the
/// origin. Axes are those of the world (x right, y up, z towards the user); the cap's own have y towards the
/// user and z down.
/// Thread: one.  RT: safe.
class SpaceMouseMotion {
 public:
  /// Deflection at the end of an axis, in counts.
  static constexpr int kFullDeflection = 350;
  /// Largest deflection reported by a released cap; beyond it the speed grows from zero.
  static constexpr int kDeadZone = 17;
  /// Longest time integrated in one step.
  static constexpr double kLongestStepS = 0.01;

  /// `full_speed_m_per_s`: speed at full deflection of an axis; `reach_m`: largest distance from the origin,
  /// per axis.
  SpaceMouseMotion(double full_speed_m_per_s, double reach_m)
      : full_speed_m_per_s_(full_speed_m_per_s), reach_m_(reach_m) {}

  /// Integrates over `dt_s`, limited to kLongestStepS.
  void step(const SpaceMouseState& cap, double dt_s);

  const rt::Vec3& position_m() const { return position_; }
  /// Returns the velocity; zero along an axis that is at its end.
  const rt::Vec3& velocity_m_per_s() const { return velocity_; }

 private:
  void stepAxis(double rt::Vec3::*axis, int deflection, double dt_s);

  double full_speed_m_per_s_;
  double reach_m_;
  rt::Vec3 position_;
  rt::Vec3 velocity_;
};

}  // namespace hapticd::drivers
