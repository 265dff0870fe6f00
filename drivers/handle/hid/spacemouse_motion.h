// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/hid/spacemouse_report.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// A place that a SpaceMouse moves: its deflection is a velocity, which is integrated from the origin on.
/// Axes as the world's (x right, y up, z towards the user); the cap's own have y towards the user and z down.
/// Thread: one.  RT: safe.
class SpaceMouseMotion {
 public:
  static constexpr int kFullDeflection = 350;
  /// A released cap rests up to that far beside zero; beyond it the speed grows from zero.
  static constexpr int kDeadZone = 17;
  static constexpr double kLongestStepS = 0.01;

  /// `full_speed_m_per_s`: at full deflection of an axis; `reach_m`: how far it may go from the origin, per
  /// axis.
  SpaceMouseMotion(double full_speed_m_per_s, double reach_m)
      : full_speed_m_per_s_(full_speed_m_per_s), reach_m_(reach_m) {}

  /// Moves on by `dt_s`, of which no more than kLongestStepS counts.
  void step(const SpaceMouseState& cap, double dt_s);

  const rt::Vec3& position_m() const { return position_; }
  /// Zero along an axis whose end is reached.
  const rt::Vec3& velocity_m_per_s() const { return velocity_; }

 private:
  void stepAxis(double rt::Vec3::*axis, int deflection, double dt_s);

  double full_speed_m_per_s_;
  double reach_m_;
  rt::Vec3 position_;
  rt::Vec3 velocity_;
};

}  // namespace hapticd::drivers
