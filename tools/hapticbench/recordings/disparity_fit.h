// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "rt/vec3.h"
#include "tools/hapticbench/camera_disparity.h"
#include "tools/hapticbench/quadratic_fit.h"

namespace hapticd::tools {

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
