// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <random>

#include "rt/base/vec3.h"

namespace hapticd::test {

/// Waist, shoulder, elbow.
using OmniJoints = std::array<double, 3>;

/// The angles while the stylus is docked: those of the driver's source, written down a second time.
inline constexpr OmniJoints kOmniDocked_rad{0, 0.23, -0.37};

/// What a driver has to find out of a device, and what acts on its arm.
struct OmniModelSettings {
  OmniJoints n_m_per_count{3e-4, 3e-4, 3e-4};
  OmniJoints friction_n_m{0.015, 0.015, 0.015};
  OmniJoints inertia_kg_m2{0.002, 0.003, 0.0015};
  double own_mass_kg = 0.04;  ///< of the forearm, as if at the wrist
  /// With the mass on the stylus, the load's inertia is added.
  double hanging_kg = 0;     ///< from the stylus
  double pull_right_kg = 0;  ///< over a pulley
};

/// The rigid arm of an Omni, with friction and stops, under gravity. Thread: one.
class OmniModel {
 public:
  OmniModelSettings settings;
  OmniJoints angles_rad = kOmniDocked_rad;
  OmniJoints velocity_rad_per_s{};

  /// Moves on by `seconds`, at most 1 ms.
  void step(double seconds, const OmniJoints& motor_n_m);

  /// The wrist: x to the right, y up, z to the person, from the axis of waist and shoulder.
  static rt::Vec3 wristAt(const OmniJoints& angles_rad);
  /// Its derivatives, by differences.
  static std::array<rt::Vec3, 3> leversAt(const OmniJoints& angles_rad);
  /// The force at the wrist that the torques exert.
  static rt::Vec3 forceOf(const OmniJoints& angles_rad, const OmniJoints& torque_n_m);

 private:
  OmniJoints loads_n_m() const;
};

/// A pose in the inner part of the workspace, where the arm is not stretched.
OmniJoints randomOmniPose(std::mt19937& random);

/// Gains with random sizes and signs.
OmniJoints randomOmniGains(std::mt19937& random);

}  // namespace hapticd::test
