// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Packs the coordinates of a pixel and its raw disparity into one 32-bit word, from which the exact position
/// of the point can be computed. Packed values sort in image order, row by row.
struct PackedPixel {
  static constexpr int kRawBits = 11;
  static constexpr int kColumnBits = 10;
  static constexpr std::uint32_t pack(std::uint32_t column, std::uint32_t row, std::uint32_t raw) noexcept {
    return (row << (kColumnBits + kRawBits)) | (column << kRawBits) | raw;
  }
  static constexpr std::uint32_t column(std::uint32_t packed) noexcept {
    return (packed >> kRawBits) & ((1U << kColumnBits) - 1);
  }
  static constexpr std::uint32_t row(std::uint32_t packed) noexcept {
    return packed >> (kColumnBits + kRawBits);
  }
  static constexpr std::uint32_t raw(std::uint32_t packed) noexcept {
    return packed & ((1U << kRawBits) - 1);
  }
};

/// A rectangle of pixels with a range of raw values, all limits inclusive; empty when a first limit is above
/// its last.
struct PixelWindow {
  int column_first = 0;
  int column_last = -1;
  int row_first = 0;
  int row_last = -1;
  std::uint16_t raw_first = 0;
  std::uint16_t raw_last = 0;

  bool empty() const noexcept { return column_first > column_last || row_first > row_last; }
};

/// Converts raw disparities to metric points, eq. (1)-(2) of the paper, by lookup tables: `P = Z(d) *
/// (ray_of_column(u) + ray_of_row(v)) + camera position`, in the world frame. The rays include the camera's
/// rotation, and Z = 1 / (a d + b).
/// Thread: immutable after construction; any thread may read it.
class DepthModel {
 public:
  /// Computes the tables.  RT: not safe.
  DepthModel(const DepthModelParameters& parameters, const PoseParameters& T_world_camera);

  /// Returns the depth along the optical axis in metres, near..far; 0 for a raw value that is no measurement
  /// or has a depth outside these limits (including a d + b <= 0, behind the camera). `raw`: 0..2047.  RT:
  /// safe.
  double depth_m(std::uint16_t raw) const noexcept { return depth_m_[raw]; }

  /// Returns the point that a pixel sees, in metres; its raw value must have a depth other than 0.  RT: safe.
  Vec3 pointInWorld(std::uint32_t packed_pixel) const noexcept {
    const double depth = depth_m_[PackedPixel::raw(packed_pixel)];
    const Ray& column = column_rays_[PackedPixel::column(packed_pixel)];
    const Ray& row = row_rays_[PackedPixel::row(packed_pixel)];
    return {depth * (column.x + row.x) + camera_position_.x, depth * (column.y + row.y) + camera_position_.y,
            depth * (column.z + row.z) + camera_position_.z};
  }

  /// Returns all pixels and raw values that can show a point within `radius_m` of `centre_m_in_world`.  RT:
  /// safe.
  PixelWindow windowOfBall(const Vec3& centre_m_in_world, double radius_m) const noexcept;
  /// Returns all pixels whose rays meet the ball, at any depth; the range of raw values is not set.  RT:
  /// safe.
  PixelWindow pixelsOfBall(const Vec3& centre_m_in_world, double radius_m) const noexcept;
  /// Returns a window of all pixels and of all raw values that have a depth.  RT: safe.
  PixelWindow wholeFrame() const noexcept;

  /// Axis-aligned box around everything that the camera can measure between near and far.
  struct Bounds {
    Vec3 lowest_m_in_world;
    Vec3 highest_m_in_world;
  };
  Bounds bounds() const noexcept { return bounds_; }

  /// Returns the largest distance in metres between the single-precision position used by the voxel grid
  /// search and the position computed by pointInWorld().
  double singlePrecisionError_m() const noexcept { return single_precision_error_m_; }

  /// A ray in double precision for vectorised evaluation; the fourth number is 0.
  struct alignas(32) Ray {
    double x, y, z, unused;
  };
  const double* depthTable_m() const noexcept { return depth_m_.data(); }
  const Ray* columnRays() const noexcept { return column_rays_.data(); }
  const Ray* rowRays() const noexcept { return row_rays_.data(); }

  /// Single-precision data for vectorised deprojection. The ray of pixel (u, v) is `middle + (u -
  /// kMiddleColumn) * column_step + (v - kMiddleRow) * row_step`.
  static constexpr float kMiddleColumn = kFrameWidth / 2;
  static constexpr float kMiddleRow = kFrameHeight / 2;
  struct SingleRay {
    float x, y, z;
  };
  struct SinglePrecisionTables {
    alignas(kCacheLine) std::array<float, kRawValues> depth_m;
    SingleRay middle;
    SingleRay column_step;
    SingleRay row_step;
  };
  const SinglePrecisionTables& singlePrecision() const noexcept { return single_; }
  const Vec3& cameraPosition_m_in_world() const noexcept { return camera_position_; }

  const DepthModelParameters& parameters() const noexcept { return parameters_; }
  /// Rotates a direction from the world frame to the camera frame (x right, y up, looking along -z).  RT:
  /// safe.
  Vec3 directionInCamera(const Vec3& direction_in_world) const noexcept {
    const auto& r = rotation_world_camera_;
    const Vec3& d = direction_in_world;
    return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
            r[2] * d.x + r[5] * d.y + r[8] * d.z};
  }
  /// Rotates a direction from the camera frame to the world frame.  RT: safe.
  Vec3 directionInWorld(const Vec3& direction_in_camera) const noexcept {
    const auto& r = rotation_world_camera_;
    const Vec3& d = direction_in_camera;
    return {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z,
            r[6] * d.x + r[7] * d.y + r[8] * d.z};
  }
  /// Transforms a position from the camera frame to the world frame.  RT: safe.
  Vec3 positionInWorld(const Vec3& p_m_in_camera) const noexcept {
    return directionInWorld(p_m_in_camera) + camera_position_;
  }
  /// Transforms a position from the world frame to the camera frame.  RT: safe.
  Vec3 positionInCamera(const Vec3& p_m_in_world) const noexcept {
    return directionInCamera(p_m_in_world - camera_position_);
  }

 private:
  /// Returns a window without pixels whose raw values are those that can have a depth between the two limits.
  PixelWindow rawsBetween(double nearest_m, double farthest_m) const noexcept;
  void tabulateDepth();
  void tabulateRays();
  void computeBounds();

  DepthModelParameters parameters_;
  std::array<double, 9> rotation_world_camera_;  // row by row
  Vec3 camera_position_;                         // in world
  std::array<double, kRawValues> depth_m_;
  std::array<Ray, kFrameWidth> column_rays_;
  std::array<Ray, kFrameHeight> row_rays_;
  SinglePrecisionTables single_;
  Bounds bounds_;
  double single_precision_error_m_ = 0;
};

}  // namespace hapticd::rt
