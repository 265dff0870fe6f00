// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "rt/base/vec3.h"
#include "tools/haptic-bridge/phantom_omni/packets.h"

namespace hapticd::tools::phantom_omni {

/// Angles of the driven joints, as their motors turn, radians. Waist: from the middle, > 0 to the person's
/// right. Shoulder: of the upper arm above level. Elbow: of the forearm from hanging straight down, > 0
/// towards the person; it does not change when the shoulder turns, because its motor sits in the base.
using JointAngles = PerJoint<double>;

inline constexpr double kUpperArm_m = 0.135;
inline constexpr double kForearm_m = 0.135;

/// The angles while the stylus is docked.
inline constexpr JointAngles kDockedAngles_rad{0, 0.23, -0.37};

/// The centre of the wrist, where the three axes of the gimbal meet and where forces act. Frame of the
/// handle: x to the right, y up, z towards the person; its origin is near the middle of the workspace.
rt::Vec3 wristAt(const JointAngles& angles_rad);

/// The wrist's velocity for a unit velocity of each joint, m/rad.
PerJoint<rt::Vec3> jacobianAt(const JointAngles& angles_rad);

/// The torques of the joints, in N m, that exert `force_n` at the wrist.
PerJoint<double> jointTorques(const JointAngles& angles_rad, const rt::Vec3& force_n);

/// Finds out what the encoders, which begin to count anywhere, show while the stylus is docked. Thread: one.
class Homing {
 public:
  static constexpr std::int64_t kStill_ns = 500'000'000;

  /// The joints' angles; nothing until the stylus was docked, with the arm still, for kStill_ns.
  std::optional<JointAngles> anglesAt(const OmniReading& reading, std::int64_t measured_ns);

 private:
  void look(const OmniReading& reading, std::int64_t measured_ns);

  bool known_ = false;
  PerJoint<std::int16_t> docked_{};          // what the encoders show there
  std::optional<std::int64_t> still_since_;  // at docked_
};

}  // namespace hapticd::tools::phantom_omni
