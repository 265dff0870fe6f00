// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "tools/lib/ros/contents.h"
#include "tools/lib/ros/operating_state.h"
#include "tools/lib/ros/tick_messages.h"

/// Messages of ROS 2 in CDR, as they stand in bags, without DDS. Each function appends one message, the four
/// bytes of the encoding in front, whose type is in its comment (message_definitions.h).
/// Thread: any.  RT: not safe.
namespace hapticd::tools::ros {

/// std_msgs/Header: the time in UTC, in nanoseconds since 1970, and the frame that the numbers refer to.
struct Header {
  std::int64_t time_ns = 0;
  std::string_view frame;
};

/// geometry_msgs/PoseStamped.
void encodePose(const Header& header, const rt::RigidPose& pose, std::string& to);
/// geometry_msgs/TwistStamped; its angular velocity is zero.
void encodeVelocity(const Header& header, const rt::Vec3& linear_m_per_s, std::string& to);
/// geometry_msgs/WrenchStamped; its torque is zero.
void encodeForce(const Header& header, const rt::Vec3& force_n, std::string& to);
/// crtk_msgs/OperatingState.
void encodeState(const Header& header, const OperatingState& state, std::string& to);
/// sensor_msgs/Joy.
void encodeButtons(const Header& header, const HeldButtons& buttons, std::string& to);
/// tf2_msgs/TFMessage; each frame refers to its parent.
void encodeFrames(std::int64_t time_ns, std::span<const FixedFrame> frames, std::string& to);
/// sensor_msgs/Image in the encoding 16UC1.
void encodeDepthImage(const Header& header, const DepthImage& image, std::string& to);
/// sensor_msgs/CameraInfo.
void encodeCameraInfo(const Header& header, const PinholeCamera& camera, std::string& to);

/// The severities of rcl_interfaces/Log.
enum class LogLevel : std::uint8_t { debug = 10, info = 20, warning = 30, error = 40, fatal = 50 };
/// rcl_interfaces/Log without a place in a source. `name`: of what logs.
void encodeLog(std::int64_t time_ns, LogLevel level, std::string_view name, std::string_view text,
               std::string& to);

}  // namespace hapticd::tools::ros
