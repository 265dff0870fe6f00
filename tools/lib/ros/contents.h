// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

/// What messages are made of, without the structures of DDS.
namespace hapticd::tools::ros {

/// A frame that does not move in another one.
struct FixedFrame {
  std::string parent;
  std::string name;
  rt::RigidPose T_parent_frame;
  friend bool operator==(const FixedFrame&, const FixedFrame&) = default;
};

/// A spring and a damper on one side of a place, for each axis of a frame (crtk_msgs): what acts along an
/// axis beyond the deadband is p times the displacement and d times the velocity, so that both are negative.
struct ImpedanceSide {
  rt::Vec3 p;     ///< N/m; of rotations N m/rad
  rt::Vec3 d;     ///< N s/m; of rotations N m s/rad
  rt::Vec3 bias;  ///< N; of rotations N m
  rt::Vec3 deadband;
};

/// crtk_msgs/CartesianImpedance.
struct Impedance {
  rt::Quaternion force_orientation;  ///< maps vectors of the springs' axes to the frame of the message
  rt::Vec3 force_position_m;
  ImpedanceSide position_positive;
  ImpedanceSide position_negative;
  ImpedanceSide orientation_positive;
  ImpedanceSide orientation_negative;
};

/// What one part of the box has to report.
struct Diagnostic {
  enum class Level : std::uint8_t { ok, warning, error, stale };  ///< as in diagnostic_msgs
  Level level = Level::ok;
  std::string name;         ///< "hapticd: camera"
  std::string message;      ///< one line for people
  std::string hardware_id;  ///< may be empty
  std::vector<std::pair<std::string, std::string>> values;
};

}  // namespace hapticd::tools::ros
