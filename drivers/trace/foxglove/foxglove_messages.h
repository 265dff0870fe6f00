// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/base/vec3.h"

/// Messages of the schemas in foxglove_schemas.h, encoded in CDR. The structures have only the parts that
/// hapticd uses; everything else is written empty. Each encode() appends one message; `realtime_ns` is
/// CLOCK_REALTIME.
/// Thread: any.  RT: not safe (allocates).
namespace hapticd::drivers::foxglove {

/// A unit quaternion.
struct Quaternion {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
};
/// Returns the rotation that a matrix describes, given row by row; it must be a rotation.
Quaternion quaternionOf(const std::array<double, 9>& rotation);
/// Returns the shortest rotation that turns the x axis into the direction of `to`, which must be finite and
/// not zero.
Quaternion rotationOfXAxisTo(const rt::Vec3& to);

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
  Quaternion rotation = {};
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

}  // namespace hapticd::drivers::foxglove
