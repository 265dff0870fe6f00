// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/trace/format/messages.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

/// Message types that Foxglove and Lichtblick draw without a plug-in (github.com/foxglove/foxglove-sdk,
/// schemas/ros2), and their messages encoded in CDR. Traces and the live view use the same ones. The
/// structures have only the parts that hapticd uses; everything else is written empty. Each encode() appends
/// one message; `realtime_ns` is CLOCK_REALTIME. Thread: any.  RT: not safe (allocates).
namespace hapticd::trace::foxglove {

// Topics and schema names. Messages are encoded in CDR.
inline constexpr ChannelName kSceneChannel{"/hapticd/scene", "foxglove_msgs/msg/SceneUpdate"};
inline constexpr ChannelName kTransformsChannel{"/hapticd/transforms", "foxglove_msgs/msg/FrameTransforms"};
inline constexpr ChannelName kReachCloudChannel{"/hapticd/cloud_reach", "foxglove_msgs/msg/PointCloud"};
// The next ones are in the live view only.
inline constexpr ChannelName kCloudChannel{"/hapticd/cloud", "foxglove_msgs/msg/PointCloud"};
inline constexpr ChannelName kImageChannel{"/hapticd/depth_image", "foxglove_msgs/msg/RawImage"};
inline constexpr ChannelName kCalibrationChannel{"/hapticd/camera_calibration",
                                                 "foxglove_msgs/msg/CameraCalibration"};
inline constexpr ChannelName kLogChannel{"/hapticd/events", "foxglove_msgs/msg/Log"};

// Names of the frames of reference (frame_id).
inline constexpr std::string_view kWorldFrame = "world";
inline constexpr std::string_view kCameraFrame = "camera";  ///< x right, y up, looking along -z
/// The same place with the axes that image panels expect: x right, y down, looking along +z.
inline constexpr std::string_view kOpticalFrame = "camera_optical";

/// Returns the text of a schema (encoding ros2msg) with the types that it depends on; "" for a name that is
/// none of the above.
std::string_view schemaOf(std::string_view schema_name);

/// Red, green, blue and opacity, 0..1.
struct Color {
  double r = 0;
  double g = 0;
  double b = 0;
  double a = 1;
};

struct Sphere {
  rt::Vec3 centre_m;
  double radius_m = 0;
  Color color;
};

struct Arrow {
  rt::Vec3 tail_m;
  rt::Vec3 tail_to_tip_m;  ///< not zero
  double shaft_diameter_m = 0;
  double head_diameter_m = 0;
  double head_length_m = 0;  ///< at most the arrow's length
  Color color;
};

/// A text that always faces the viewer.
struct Label {
  rt::Vec3 position_m;
  double height_px = 0;
  Color color;
  std::string text;
};

/// A part of the scene in the world frame; it replaces the earlier one with the same id.
struct Entity {
  std::string_view id;
  std::vector<Arrow> arrows = {};
  std::vector<Sphere> spheres = {};
  std::vector<Label> labels = {};
};
void encodeScene(std::uint64_t realtime_ns, std::span<const Entity> entities, std::string& to);

/// T_parent_child: the pose of the frame `child` in the frame `parent`.
struct Transform {
  std::string_view parent;
  std::string_view child;
  rt::Vec3 translation_m = {};
  rt::Quaternion rotation = {};
};
void encodeTransforms(std::uint64_t realtime_ns, std::span<const Transform> transforms, std::string& to);

/// Points in metres: x, y, z, x, y, z, ...
void encodePointCloud(std::uint64_t realtime_ns, std::string_view frame_id, std::span<const float> points_m,
                      std::string& to);

/// An image whose pixels have 16 bits, little-endian (encoding "16UC1").
struct Image {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::uint32_t stride_bytes = 0;
  std::string_view bytes;
};
void encodeImage(std::uint64_t realtime_ns, std::string_view frame_id, const Image& image, std::string& to);

/// A pinhole camera without distortion.
struct Calibration {
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
};
void encodeCalibration(std::uint64_t realtime_ns, std::string_view frame_id, const Calibration& calibration,
                       std::string& to);

enum class LogLevel : std::uint8_t { unknown, debug, info, warning, error, fatal };
/// `name`: of the part of the system that the message comes from.
void encodeLog(std::uint64_t realtime_ns, LogLevel level, std::string_view name, std::string_view message,
               std::string& to);

}  // namespace hapticd::trace::foxglove
