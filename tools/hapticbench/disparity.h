// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_model.h"
#include "tools/hapticbench/engine/sequences.h"

namespace hapticd::tools {

/// A value at a position; x and y from -1 to 1 or not far beyond.
struct QuadraticSample {
  double x = 0;
  double y = 0;
  double value = 0;
};

/// c0 + c1 x + c2 y + c3 x^2 + c4 x y + c5 y^2: the disparity of a plane or of a gently curved surface.
struct Quadratic {
  std::array<double, 6> coefficients{};

  double at(double x, double y) const noexcept {
    const auto& c = coefficients;
    return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
  }
};

struct QuadraticFit {
  Quadratic quadratic{};
  double deviation = 0;      ///< standard deviation of the residuals by their median: outliers do not count
  double outlier_share = 0;  ///< of the samples; see QuadraticFitOptions
};

struct QuadraticFitOptions {
  int rounds = 8;
  double least_deviation = 0;     ///< below which rounding of the values dominates
  double outlier_deviations = 5;  ///< a residual beyond that many deviations is an outlier,
  double least_outlier = 0;       ///< where it is also beyond that
};

/// Fits by least squares, reweighted with Tukey's biweight whose width follows the median of the residuals.
/// Nothing where the samples do not determine it.
std::optional<QuadraticFit> fitQuadratic(std::span<const QuadraticSample> samples,
                                         const QuadraticFitOptions& options);

/// The raw values of any camera as the raw disparities in which the core models surfaces
/// (rt::DepthModel::disparity()), not rounded; those of a Kinect v1 are its raw values. A plane in space is a
/// plane in them. Everything is in the camera's frame: x right, y up, -z ahead. Thread: any.
class CameraDisparity {
 public:
  explicit CameraDisparity(const rt::DepthModelParameters& camera);

  const rt::DepthModel& model() const { return model_; }
  int width_px() const { return model_.width_px(); }
  int height_px() const { return model_.height_px(); }
  /// Where a pixel is in the image of a frame.
  std::size_t pixelOf(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(model_.stride_px()) +
           static_cast<std::size_t>(column);
  }

  /// The disparity of a raw value, whether the camera's limits of depth include it or not; NaN if it is no
  /// measurement.
  float of(std::uint16_t raw) const { return of_raw_[raw]; }
  double depth_m(double disparity) const { return 1 / model_.disparity().inverseDepth_per_m(disparity); }
  double ofDepth(double depth_m) const { return model_.disparity().rawOf(depth_m); }
  bool isNearer(double disparity, double than) const {
    return model_.disparity().a_per_m < 0 ? disparity < than : disparity > than;
  }
  /// The point on the ray of (column, row) with that disparity, metres.
  rt::Vec3 pointOf(double column, double row, double disparity) const;

  /// The camera's noise there relative to a Kinect's, for tolerances that are stated in its raw units.
  double noiseScale(double disparity) const { return model_.noiseScale(depth_m(disparity)); }
  /// Standard deviation of a pixel from frame to frame as the camera states it; 0 if it does not.
  double changingNoise(double disparity) const;
  /// One unit of disparity at a depth, metres.
  double unit_m(double depth_m) const { return model_.disparity().unit_m(depth_m); }
  /// Over how many pixels errors are alike.
  double correlation_px() const { return model_.parameters().noise.correlation_px; }

 private:
  rt::DepthModel model_;
  std::vector<float> of_raw_;
};

/// The camera of a sequence; one that does not state its noise, and is no Kinect v1, has what the frames show
/// where the scene rests, for tolerances.
rt::DepthModelParameters cameraWithNoise(const BenchSequence& sequence);

/// A disparity at a pixel, see CameraDisparity.
struct DisparitySample {
  double column = 0;
  double row = 0;
  double raw = 0;
};

/// Disparity as a quadratic of column and row: a plane's is linear, the rest takes curvature and the lens.
struct DisparityQuadratic {
  double middle_column = 0;
  double middle_row = 0;
  double half_px = 1;     ///< the unit of columns and rows, counted from the middle
  Quadratic quadratic{};  ///< raw units

  double at(double column, double row) const {
    return quadratic.at((column - middle_column) / half_px, (row - middle_row) / half_px);
  }
};

/// A quadratic through samples, and how well it is known.
struct RobustFit {
  DisparityQuadratic quadratic;
  double residual_raw = 0;   ///< robust standard deviation of the samples about it
  double outlier_share = 0;  ///< of samples more than 4 of these away
};

/// Fits a quadratic; returns nothing for fewer than 30 samples or samples that do not determine it.
std::optional<RobustFit> fitDisparity(std::span<const DisparitySample> samples, double middle_column,
                                      double middle_row, double half_px);

/// A point of the quadratic's surface and the unit vector out of the solid there, towards the camera.
struct SurfacePoint {
  rt::Vec3 position_m;
  rt::Vec3 normal;
};
SurfacePoint surfacePoint(const CameraDisparity& camera, const DisparityQuadratic& quadratic, double column,
                          double row);

}  // namespace hapticd::tools
