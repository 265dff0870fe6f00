// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "drivers/trace/format/messages.h"

/// Message types that Foxglove and Lichtblick draw without a plug-in (github.com/foxglove/foxglove-sdk,
/// schemas/ros2). Traces and the live view use the same ones.
namespace hapticd::drivers::foxglove {

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

}  // namespace hapticd::drivers::foxglove
