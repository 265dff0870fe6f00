// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

/// A camera without distortion that looks along z, x right and y down, as ROS 2 has optical frames.
struct PinholeCamera {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  double fx_px = 0;  ///< focal lengths
  double fy_px = 0;
  double cx_px = 0;  ///< principal point, from the middle of the upper left pixel
  double cy_px = 0;
  friend bool operator==(const PinholeCamera&, const PinholeCamera&) = default;
};

/// A depth image: of each pixel its depth along the optical axis in millimetres, row by row from the upper
/// left one; 0: no measurement (REP-118).
struct DepthImage {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::vector<std::uint16_t> depth_mm;
};

/// A shape to be drawn (visualization_msgs/Marker).
struct Marker {
  enum class Kind : std::int32_t {  ///< as in visualization_msgs
    arrow = 0,                      ///< from the first point to the second
    cube = 1,
    sphere = 2,
    cylinder = 3,    ///< along its z axis
    line_strip = 4,  ///< scale_m.x: the width of the line
    line_list = 5,   ///< likewise, each two points a line
    text = 9,        ///< scale_m.z: the height of a letter
    triangles = 11,  ///< each three points a triangle
  };
  std::string name;     ///< of what it shows
  std::int32_t id = 0;  ///< tells the markers with one name apart
  Kind kind = Kind::cube;
  rt::RigidPose T_frame_marker;
  rt::Vec3 scale_m{1, 1, 1};                ///< of a cube its edges, of a sphere its diameters
  std::array<float, 4> colour{1, 1, 1, 1};  ///< red, green, blue, opacity, 0..1
  std::vector<rt::Vec3> points_m;           ///< in the frame of the marker
  std::string text;
  friend bool operator==(const Marker&, const Marker&) = default;
};

}  // namespace hapticd::tools::ros
