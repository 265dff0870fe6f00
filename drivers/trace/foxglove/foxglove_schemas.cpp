// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/foxglove/foxglove_schemas.h"

#include <algorithm>
#include <array>
#include <utility>

namespace hapticd::drivers::foxglove {
namespace {

// Field for field what the published schemas say; tests/foxglove compares them with the package
// @foxglove/schemas.

constexpr std::string_view kSceneUpdate = R"(foxglove_msgs/SceneEntityDeletion[] deletions
foxglove_msgs/SceneEntity[] entities
================================================================================
MSG: foxglove_msgs/SceneEntityDeletion
builtin_interfaces/Time timestamp
uint8 MATCHING_ID=0
uint8 ALL=1
uint8 type
string id
================================================================================
MSG: foxglove_msgs/SceneEntity
builtin_interfaces/Time timestamp
string frame_id
string id
builtin_interfaces/Duration lifetime
bool frame_locked
foxglove_msgs/KeyValuePair[] metadata
foxglove_msgs/ArrowPrimitive[] arrows
foxglove_msgs/CubePrimitive[] cubes
foxglove_msgs/SpherePrimitive[] spheres
foxglove_msgs/CylinderPrimitive[] cylinders
foxglove_msgs/LinePrimitive[] lines
foxglove_msgs/TriangleListPrimitive[] triangles
foxglove_msgs/TextPrimitive[] texts
foxglove_msgs/ModelPrimitive[] models
================================================================================
MSG: foxglove_msgs/KeyValuePair
string key
string value
================================================================================
MSG: foxglove_msgs/ArrowPrimitive
geometry_msgs/Pose pose
float64 shaft_length
float64 shaft_diameter
float64 head_length
float64 head_diameter
foxglove_msgs/Color color
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: foxglove_msgs/Color
float64 r
float64 g
float64 b
float64 a
================================================================================
MSG: foxglove_msgs/CubePrimitive
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
foxglove_msgs/Color color
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: foxglove_msgs/SpherePrimitive
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
foxglove_msgs/Color color
================================================================================
MSG: foxglove_msgs/CylinderPrimitive
geometry_msgs/Pose pose
geometry_msgs/Vector3 size
float64 bottom_scale
float64 top_scale
foxglove_msgs/Color color
================================================================================
MSG: foxglove_msgs/LinePrimitive
uint8 LINE_STRIP=0
uint8 LINE_LOOP=1
uint8 LINE_LIST=2
uint8 type
geometry_msgs/Pose pose
float64 thickness
bool scale_invariant
geometry_msgs/Point[] points
foxglove_msgs/Color color
foxglove_msgs/Color[] colors
uint32[] indices
================================================================================
MSG: foxglove_msgs/TriangleListPrimitive
geometry_msgs/Pose pose
geometry_msgs/Point[] points
foxglove_msgs/Color color
foxglove_msgs/Color[] colors
uint32[] indices
================================================================================
MSG: foxglove_msgs/TextPrimitive
geometry_msgs/Pose pose
bool billboard
float64 font_size
bool scale_invariant
foxglove_msgs/Color color
string text
================================================================================
MSG: foxglove_msgs/ModelPrimitive
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
foxglove_msgs/Color color
bool override_color
string url
string media_type
uint8[] data
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
)";

constexpr std::string_view kFrameTransforms = R"(foxglove_msgs/FrameTransform[] transforms
================================================================================
MSG: foxglove_msgs/FrameTransform
builtin_interfaces/Time timestamp
string parent_frame_id
string child_frame_id
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

constexpr std::string_view kPointCloud = R"(builtin_interfaces/Time timestamp
string frame_id
geometry_msgs/Pose pose
uint32 point_stride
foxglove_msgs/PackedElementField[] fields
uint8[] data
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: foxglove_msgs/PackedElementField
string name
uint32 offset
uint8 UNKNOWN=0
uint8 UINT8=1
uint8 INT8=2
uint8 UINT16=3
uint8 INT16=4
uint8 UINT32=5
uint8 INT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
uint8 type
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

constexpr std::string_view kRawImage = R"(builtin_interfaces/Time timestamp
string frame_id
uint32 width
uint32 height
string encoding
uint32 step
uint8[] data
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

constexpr std::string_view kCameraCalibration = R"(builtin_interfaces/Time timestamp
string frame_id
uint32 width
uint32 height
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

constexpr std::string_view kLog = R"(builtin_interfaces/Time timestamp
uint8 UNKNOWN=0
uint8 DEBUG=1
uint8 INFO=2
uint8 WARNING=3
uint8 ERROR=4
uint8 FATAL=5
uint8 level
string message
string name
string file
uint32 line
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kSchemas{
    {{kSceneChannel.schema, kSceneUpdate},
     {kTransformsChannel.schema, kFrameTransforms},
     {kCloudChannel.schema, kPointCloud},
     {kImageChannel.schema, kRawImage},
     {kCalibrationChannel.schema, kCameraCalibration},
     {kLogChannel.schema, kLog}}};

}  // namespace

std::string_view schemaOf(std::string_view schema_name) {
  const auto* const found =
      std::ranges::find(kSchemas, schema_name, &std::pair<std::string_view, std::string_view>::first);
  return found == kSchemas.end() ? std::string_view{} : found->second;
}

}  // namespace hapticd::drivers::foxglove
