// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

/// The messages of ROS 2 that hapticd writes and reads, in CDR, wherever they go: into traces and bags, to
/// viewers and over DDS. message_definitions.h has their fields. Thread: any.  RT: not safe.
namespace hapticd::trace::ros {

/// std_msgs/Header: the time in UTC, in nanoseconds since 1970, and the frame that the numbers refer to.
struct Header {
  std::int64_t time_ns = 0;
  std::string_view frame;
};

/// A frame that does not move in another one.
struct FixedFrame {
  std::string parent;
  std::string name;
  rt::RigidPose T_parent_frame;
  friend bool operator==(const FixedFrame&, const FixedFrame&) = default;
};

/// The state of a device as CRTK has it.
struct OperatingState {
  std::string_view state;  ///< DISABLED, ENABLED, PAUSED or FAULT
  bool is_homed = false;   ///< its positions mean something
  bool is_busy = false;    ///< it is on its way to a state, and what it is asked for has to wait

  friend bool operator==(const OperatingState&, const OperatingState&) = default;
};

/// What sensor_msgs/Joy says of a handle.
struct HeldButtons {
  std::int64_t time_ns = 0;        ///< CLOCK_MONOTONIC of the measurement
  std::vector<float> axes;         ///< the opening angle of the gripper in radians; empty: there is none
  std::vector<std::int32_t> held;  ///< by button: 1 while it is held, else 0
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

using Colour = std::array<float, 4>;  ///< red, green, blue, opacity, 0..1

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
  /// What a viewer does with the one that it has of the same name and id, likewise.
  enum class Action : std::int32_t { show = 0, remove = 2, remove_all = 3 };

  std::string name = {};  ///< of what it shows
  std::int32_t id = 0;    ///< tells the markers with one name apart
  Kind kind = Kind::cube;
  Action action = Action::show;
  rt::RigidPose T_frame_marker = {};
  rt::Vec3 scale_m{1, 1, 1};  ///< of a cube its edges, of a sphere its diameters
  Colour colour{1, 1, 1, 1};
  std::vector<rt::Vec3> points_m = {};  ///< in the frame of the marker
  std::string text = {};
  friend bool operator==(const Marker&, const Marker&) = default;
};

/// The severities of rcl_interfaces/Log.
enum class LogLevel : std::uint8_t { debug = 10, info = 20, warning = 30, error = 40, fatal = 50 };

/// A program of ROS 2 with the readers and writers of its nodes (rmw_dds_common/ParticipantEntitiesInfo).
using Gid = std::array<std::uint8_t, 16>;
struct AnnouncedNode {
  static constexpr std::size_t kLongestName = 256;
  std::string_view name_space;  ///< with the slash in front; it and the name: at most kLongestName bytes
  std::string_view name;
  std::vector<Gid> readers;
  std::vector<Gid> writers;
};
struct Announcement {
  Gid participant{};
  std::vector<AnnouncedNode> nodes;
};

// Each function appends one message, the four bytes of the encoding in front; its type is in the comment.

/// geometry_msgs/PoseStamped.
void encodePose(const Header& header, const rt::RigidPose& pose, std::string& to);
/// geometry_msgs/TwistStamped; its angular velocity is zero.
void encodeVelocity(const Header& header, const rt::Vec3& linear_m_per_s, std::string& to);
/// geometry_msgs/WrenchStamped.
void encodeWrench(const Header& header, const rt::Vec3& force_n, const rt::Vec3& torque_n_m, std::string& to);
/// crtk_msgs/OperatingState.
void encodeState(const Header& header, const OperatingState& state, std::string& to);
/// sensor_msgs/Joy.
void encodeButtons(const Header& header, const HeldButtons& buttons, std::string& to);
/// diagnostic_msgs/DiagnosticArray.
void encodeDiagnostics(const Header& header, std::span<const Diagnostic> parts, std::string& to);
/// tf2_msgs/TFMessage; each frame refers to its parent.
void encodeFrames(std::int64_t time_ns, std::span<const FixedFrame> frames, std::string& to);
/// sensor_msgs/PointCloud2: a list of points. `xyz_m`: x, y and z of each in metres.
void encodePoints(const Header& header, std::span<const float> xyz_m, std::string& to);
/// sensor_msgs/Image in the encoding 16UC1.
void encodeDepthImage(const Header& header, const DepthImage& image, std::string& to);
/// sensor_msgs/CameraInfo.
void encodeCameraInfo(const Header& header, const PinholeCamera& camera, std::string& to);
/// visualization_msgs/MarkerArray.
void encodeMarkers(const Header& header, std::span<const Marker> markers, std::string& to);
/// rcl_interfaces/Log without a place in a source. `name`: of what logs.
void encodeLog(std::int64_t time_ns, LogLevel level, std::string_view name, std::string_view text,
               std::string& to);
/// std_msgs/Bool.
void encodeFlag(bool flag, std::string& to);
/// rmw_dds_common/ParticipantEntitiesInfo.
void encodeAnnouncement(const Announcement& announcement, std::string& to);

// What is read of messages of others. Texts are those of the message, and valid as long as it is.

struct StampedPose {  ///< geometry_msgs/PoseStamped
  Header header;
  rt::RigidPose pose;
};
struct StampedWrench {  ///< geometry_msgs/WrenchStamped
  Header header;
  rt::Vec3 force_n;
  rt::Vec3 torque_n_m;
};
struct StampedText {  ///< crtk_msgs/StringStamped
  Header header;
  std::string_view text;
};
struct StampedState {  ///< crtk_msgs/OperatingState
  Header header;
  OperatingState state;
};
struct StampedImpedance {  ///< crtk_msgs/CartesianImpedance, the place of rotations left out
  Header header;
  Impedance impedance;
};
struct JointPositions {  ///< sensor_msgs/JointState up to the positions
  Header header;
  std::vector<double> positions;  ///< rad or m
};
struct Flag {  ///< std_msgs/Bool
  bool flag = false;
};

/// Reads a message, in either order of bytes; nothing: it is none of this type. `Message`: one of those
/// above, or Announcement.
template <typename Message>
std::optional<Message> decode(std::string_view message);

}  // namespace hapticd::trace::ros
