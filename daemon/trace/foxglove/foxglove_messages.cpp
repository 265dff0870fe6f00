// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/foxglove/foxglove_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "daemon/trace/format/cdr.h"
#include "rt/base/clock.h"

namespace hapticd::trace::foxglove {
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

namespace {

void writeNumbers(CdrWriter& to, std::initializer_list<double> numbers) {
  for (const double number : numbers) to.number(number);
}

void writeTime(CdrWriter& to, std::uint64_t realtime_ns) {
  to.number(static_cast<std::int32_t>(realtime_ns / rt::kNsPerSecond));
  to.number(static_cast<std::uint32_t>(realtime_ns % rt::kNsPerSecond));
}

void writeCount(CdrWriter& to, std::size_t count) {
  to.number(static_cast<std::uint32_t>(count));
}

void write(CdrWriter& to, const rt::Vec3& vector) {
  writeNumbers(to, {vector.x, vector.y, vector.z});
}

void write(CdrWriter& to, const rt::Quaternion& rotation) {
  writeNumbers(to, {rotation.x, rotation.y, rotation.z, rotation.w});
}

void writePose(CdrWriter& to, const rt::Vec3& position_m, const rt::Quaternion& rotation) {
  write(to, position_m);
  write(to, rotation);
}

void write(CdrWriter& to, const Color& color) {
  writeNumbers(to, {color.r, color.g, color.b, color.a});
}

void write(CdrWriter& to, const Arrow& arrow) {
  writePose(to, arrow.tail_m, rt::shortestRotation({1, 0, 0}, arrow.tail_to_tip_m));
  const double shaft_m = std::max(0.0, rt::norm(arrow.tail_to_tip_m) - arrow.head_length_m);
  writeNumbers(to, {shaft_m, arrow.shaft_diameter_m, arrow.head_length_m, arrow.head_diameter_m});
  write(to, arrow.color);
}

void write(CdrWriter& to, const Sphere& sphere) {
  writePose(to, sphere.centre_m, {});
  const double diameter_m = 2 * sphere.radius_m;
  writeNumbers(to, {diameter_m, diameter_m, diameter_m});
  write(to, sphere.color);
}

void write(CdrWriter& to, const Label& label) {
  writePose(to, label.position_m, {});
  to.number(true);  // billboard: it faces the viewer
  to.number(label.height_px);
  to.number(true);  // scale_invariant: the height is in pixels
  write(to, label.color);
  to.text(label.text);
}

template <typename Part>
void writeAll(CdrWriter& to, const std::vector<Part>& parts) {
  writeCount(to, parts.size());
  for (const Part& part : parts) write(to, part);
}

void writeEntity(CdrWriter& to, std::uint64_t realtime_ns, const Entity& entity) {
  writeTime(to, realtime_ns);
  to.text(kWorldFrame);
  to.text(entity.id);
  to.number(std::int32_t{0});  // lifetime: until it is replaced
  to.number(std::uint32_t{0});
  to.number(false);   // frame_locked
  writeCount(to, 0);  // metadata
  writeAll(to, entity.arrows);
  writeCount(to, 0);  // cubes
  writeAll(to, entity.spheres);
  writeCount(to, 0);  // cylinders
  writeCount(to, 0);  // lines
  writeCount(to, 0);  // triangles
  writeAll(to, entity.labels);
  writeCount(to, 0);  // models
}

}  // namespace

void encodeScene(std::uint64_t realtime_ns, std::span<const Entity> entities, std::string& to) {
  CdrWriter writer(to);
  writeCount(writer, 0);  // deletions
  writeCount(writer, entities.size());
  for (const Entity& entity : entities) writeEntity(writer, realtime_ns, entity);
}

void encodeTransforms(std::uint64_t realtime_ns, std::span<const Transform> transforms, std::string& to) {
  CdrWriter writer(to);
  writeCount(writer, transforms.size());
  for (const Transform& transform : transforms) {
    writeTime(writer, realtime_ns);
    writer.text(transform.parent);
    writer.text(transform.child);
    write(writer, transform.translation_m);
    write(writer, transform.rotation);
  }
}

void encodePointCloud(std::uint64_t realtime_ns, std::string_view frame_id, std::span<const float> points_m,
                      std::string& to) {
  constexpr std::uint8_t kFloat32 = 7;
  constexpr std::uint32_t kStride = 3 * sizeof(float);
  CdrWriter writer(to);
  writeTime(writer, realtime_ns);
  writer.text(frame_id);
  writePose(writer, {}, {});
  writer.number(kStride);
  writeCount(writer, 3);
  std::uint32_t offset = 0;
  for (const std::string_view name : {"x", "y", "z"}) {
    writer.text(name);
    writer.number(offset);
    writer.number(kFloat32);
    offset += sizeof(float);
  }
  writer.bytes({reinterpret_cast<const char*>(points_m.data()), points_m.size_bytes()});
}

void encodeImage(std::uint64_t realtime_ns, std::string_view frame_id, const Image& image, std::string& to) {
  CdrWriter writer(to);
  writeTime(writer, realtime_ns);
  writer.text(frame_id);
  writer.number(image.width_px);
  writer.number(image.height_px);
  writer.text("16UC1");
  writer.number(image.stride_bytes);
  writer.bytes(image.bytes);
}

void encodeCalibration(std::uint64_t realtime_ns, std::string_view frame_id, const Calibration& calibration,
                       std::string& to) {
  const auto& [width_px, height_px, fx, fy, cx, cy] = calibration;
  CdrWriter writer(to);
  writeTime(writer, realtime_ns);
  writer.text(frame_id);
  writer.number(width_px);
  writer.number(height_px);
  writer.text("");        // distortion_model: none
  writeCount(writer, 0);  // d
  writeNumbers(writer, {fx, 0, cx, 0, fy, cy, 0, 0, 1});
  writeNumbers(writer, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  writeNumbers(writer, {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0});
}

void encodeLog(std::uint64_t realtime_ns, LogLevel level, std::string_view name, std::string_view message,
               std::string& to) {
  CdrWriter writer(to);
  writeTime(writer, realtime_ns);
  writer.number(static_cast<std::uint8_t>(level));
  writer.text(message);
  writer.text(name);
  writer.text("");                  // file
  writer.number(std::uint32_t{0});  // line
}

}  // namespace hapticd::trace::foxglove
