// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::rt {

/// Packs the coordinates of a pixel and the lowest bits of its raw value into one 32-bit word, from which the
/// exact position of the point can be computed. Packed values sort in image order, row by row. Raw values of
/// more bits follow from the lowest ones because those of a scene cover less than kRawRange values from its
/// first one on.
struct PackedPixel {
  static constexpr int kRawBits = 11;
  static constexpr int kColumnBits = 11;
  static constexpr std::uint32_t kRawRange = 1U << kRawBits;
  static_assert(kMaxFrameWidth <= 1 << kColumnBits && kMaxFrameHeight <= 1 << (32 - kColumnBits - kRawBits));

  static constexpr std::uint32_t pack(std::uint32_t column, std::uint32_t row, std::uint32_t raw) noexcept {
    return (row << (kColumnBits + kRawBits)) | (column << kRawBits) | (raw & (kRawRange - 1));
  }
  static constexpr std::uint32_t column(std::uint32_t packed) noexcept {
    return (packed >> kRawBits) & ((1U << kColumnBits) - 1);
  }
  static constexpr std::uint32_t row(std::uint32_t packed) noexcept {
    return packed >> (kColumnBits + kRawBits);
  }
  /// Returns the raw value, which is one of the kRawRange values from `raw_first` on.
  static constexpr std::uint32_t raw(std::uint32_t packed, std::uint32_t raw_first = 0) noexcept {
    return raw_first + ((packed - raw_first) & (kRawRange - 1));
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

/// The raw disparities in which surfaces are modelled, see DisparityFrame: 1/Z = a raw + b.
struct DisparityScale {
  double a_per_m;  ///< not 0; < 0 unless the camera's own scale rises with nearness
  double b_per_m;
  std::uint16_t last_raw;  ///< the greatest raw disparity; greater ones are no measurements

  double inverseDepth_per_m(double raw) const noexcept { return a_per_m * raw + b_per_m; }
  double rawOf(double depth_m) const noexcept { return (1 / depth_m - b_per_m) / a_per_m; }
  /// Returns the size of one raw unit at a depth, in metres.
  double unit_m(double depth_m) const noexcept { return std::abs(a_per_m) * depth_m * depth_m; }
};

/// A tolerance that is linear in the raw disparity.
struct DisparityTolerance {
  double at_zero;
  double per_raw;

  double at(double raw) const noexcept { return at_zero + per_raw * raw; }
};

/// Reasons why a camera's parameters cannot be used.
enum class CameraFault : std::uint8_t {
  none,
  size,        ///< the frame is empty or larger than kMaxFrameWidth x kMaxFrameHeight
  intrinsics,  ///< a focal length that is not positive, or a number that is not finite
  depth_law,   ///< no raw value has a depth between near and far
  limits,      ///< not 0 < near < far
  noise,       ///< a negative standard deviation, or a share or length out of range
};
constexpr auto wordsOf(CameraFault) {
  return words<CameraFault>("none", "frame size", "intrinsics", "depth law", "near and far limit", "noise");
}

/// Returns the first fault of a camera, or `none` if a DepthModel can be made of it.
/// Thread: any.  RT: safe.
CameraFault faultOf(const DepthModelParameters& camera) noexcept;

/// Returns the standard deviation of a pixel's Z in metres at a depth, its rounding to the camera's depth
/// unit included; 0 if the camera's noise is not known. The noise of cameras that deliver disparity includes
/// it already.
/// Thread: any.  RT: safe.
double noiseOfPixel_m(const DepthModelParameters& camera, double depth_m) noexcept;

/// Returns the standard deviation of the mean over a square of pixels relative to that of a pixel, for noise
/// whose correlation falls linearly along rows and along columns and is 0 from `correlation_px` pixels on.
/// Thread: any.  RT: safe.
double noiseOfMean(int side_px, double correlation_px) noexcept;

/// Converts raw values to metric points, eq. (1)-(2) of the paper: `P = Z(raw) * (ray_of_column(u) +
/// ray_of_row(v)) + camera position`, in the world frame. The rays include the camera's rotation. Z follows
/// from the camera's depth law: by a table for reciprocal laws, by a product for linear ones.
/// Thread: immutable after construction; any thread may read it.
class DepthModel {
 public:
  /// Computes the tables. `parameters` have no fault, see faultOf().  RT: not safe.
  DepthModel(const DepthModelParameters& parameters, const PoseParameters& T_world_camera);
  DepthModel(const DepthModel&) = delete;
  DepthModel& operator=(const DepthModel&) = delete;

  int width_px() const noexcept { return parameters_.width_px; }
  int height_px() const noexcept { return parameters_.height_px; }
  /// Returns the distance between rows of an image in pixels.
  int stride_px() const noexcept { return strideOf(parameters_.width_px); }
  /// Returns the number of pixels of an image, with the padding of its rows.
  std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(stride_px()) * static_cast<std::size_t>(height_px());
  }
  bool isLinear() const noexcept { return parameters_.law == DepthLawKind::linear; }

  /// Returns the depth along the optical axis in metres, near..far; 0 for a raw value that is no measurement
  /// or has a depth outside these limits (including a d + b <= 0, behind the camera).  RT: safe.
  double depth_m(std::uint16_t raw) const noexcept {
    if (raw < raw_first_ || raw > raw_last_) return 0;
    return isLinear() ? parameters_.unit_m * raw : depth_m_[raw];
  }
  /// Returns the depth of a raw value that is a real number, whatever the limits; 0 behind the camera.
  double depthOfReal_m(double raw) const noexcept {
    if (isLinear()) return std::max(0.0, parameters_.unit_m * raw);
    const double inverse_depth = parameters_.a_per_m * raw + parameters_.b_per_m;
    return inverse_depth > 0 ? 1 / inverse_depth : 0;
  }
  /// Returns the raw value of a depth in metres, > 0, as a real number.  RT: safe.
  double rawOf(double depth_m) const noexcept {
    if (isLinear()) return depth_m / parameters_.unit_m;
    return (1 / depth_m - parameters_.b_per_m) / parameters_.a_per_m;
  }
  /// Returns true if a raw value is a measurement, whatever its depth.  RT: safe.
  bool isMeasurement(std::uint16_t raw) const noexcept {
    return raw != parameters_.raw_no_measurement && raw < parameters_.raw_values;
  }
  /// Returns true if a raw value is a measurement of a depth nearer than the near limit.  RT: safe.
  bool isNearerThanLimit(std::uint16_t raw) const noexcept {
    if (!isMeasurement(raw)) return false;
    if (isLinear()) return parameters_.unit_m * raw < parameters_.near_m;
    return parameters_.a_per_m * raw + parameters_.b_per_m > 1 / parameters_.near_m;
  }
  /// First and last raw value that can have a depth.
  std::uint16_t firstRaw() const noexcept { return raw_first_; }
  std::uint16_t lastRaw() const noexcept { return raw_last_; }

  /// Returns true if the camera's raw values are the raw disparities of surfaces.
  bool rawIsDisparity() const noexcept { return raw_is_disparity_; }
  /// Returns a window of all pixels and of all raw disparities that can have a depth.  RT: safe.
  PixelWindow wholeDisparity() const noexcept;
  /// Returns the scale of the raw disparities in which surfaces are modelled: the camera's own if it delivers
  /// them in at most 13 bits, else one that reaches from near_m to infinity.
  const DisparityScale& disparity() const noexcept { return disparity_; }
  /// Returns the raw value that is nearest to a raw disparity; raw_no_measurement where none has a depth.
  /// RT: safe.
  std::uint16_t rawOfDisparity(double disparity) const noexcept;
  /// Returns the raw disparity, rounded, of a raw value; kNoRawDisparity if it has no depth.  RT: safe.
  std::uint16_t disparityOf(std::uint16_t raw) const noexcept;
  /// Returns the noise of one pixel's raw disparity at a depth, relative to that of a Kinect v1, whose errors
  /// the tolerances of all filters and laws are stated for; 1 for a Kinect and where the noise is not known.
  /// RT: safe.
  double noiseScale(double depth_m) const noexcept;
  /// Returns an upper bound of noiseScale() by raw disparity, exact at the near and the far limit. Between
  /// them sigma / Z^2 is a convex function of 1/Z, and so of the disparity, so that its chord lies above it.
  const DisparityTolerance& noiseBound() const noexcept { return noise_bound_; }
  /// Returns what one raw unit of a Kinect v1 with the same noise would measure at a depth, in metres.
  double noiseUnit_m(double depth_m) const noexcept {
    return noiseScale(depth_m) * disparity_.unit_m(depth_m);
  }

  /// Returns the point that a pixel sees, in metres; its raw value, one of the PackedPixel::kRawRange values
  /// from `raw_first` on, must have a depth other than 0.  RT: safe.
  Vec3 pointInWorld(std::uint32_t packed_pixel, std::uint32_t raw_first = 0) const noexcept {
    const double depth = depth_m(static_cast<std::uint16_t>(PackedPixel::raw(packed_pixel, raw_first)));
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
  const Ray* columnRays() const noexcept { return column_rays_.get(); }
  const Ray* rowRays() const noexcept { return row_rays_.get(); }

  /// Single-precision data for vectorised deprojection. The ray of pixel (u, v) is `middle + (u -
  /// middle_column) * column_step + (v - middle_row) * row_step`.
  struct SingleRay {
    float x, y, z;
  };
  struct SinglePrecisionTables {
    const float* depth_m;     ///< [raw_values] of a reciprocal law; null for a linear one
    std::int32_t raw_values;  ///< size of the table
    float unit_m;             ///< of a linear law
    float middle_column;
    float middle_row;
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
  PixelWindow withAllPixels(PixelWindow window) const noexcept;
  void tabulateDepth();
  void findValidRaws();
  void chooseDisparity();
  void tabulateRays();
  void computeBounds();

  DepthModelParameters parameters_;
  std::array<double, 9> rotation_world_camera_;  // row by row
  Vec3 camera_position_;                         // in world
  std::uint32_t table_size_;                     // 0 with a linear law
  std::unique_ptr<double[]> depth_m_;            // by raw value
  std::unique_ptr<float[]> single_depth_m_;      // the same, and one more vector
  std::uint16_t raw_first_ = 1;
  std::uint16_t raw_last_ = 0;
  bool raw_is_disparity_;
  DisparityScale disparity_{};
  DisparityTolerance noise_bound_{};
  std::unique_ptr<Ray[]> column_rays_;  // [width_px]
  std::unique_ptr<Ray[]> row_rays_;     // [height_px]
  SinglePrecisionTables single_{};
  Bounds bounds_;
  double single_precision_error_m_ = 0;
};

}  // namespace hapticd::rt
