// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/depth/depth_model.h"
#include "rt/scene/focus_body.h"

namespace hapticd::rt {

/// Pixels around a focus in a square window, cell by cell. Each cell begins at a multiple of kAlignment and
/// is filled up with samples of weight 0.
struct BodySamples {
  static constexpr int kCellsPerSide = 3;
  static constexpr int kCells = kCellsPerSide * kCellsPerSide;
  /// Largest number of samples in a row of the window.
  static constexpr int kMaxPerSide = 67;
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kMax = kMaxPerSide * kMaxPerSide + kCells * kAlignment;

  alignas(64) float column_px[kMax];  ///< from the focus
  alignas(64) float row_px[kMax];
  alignas(64) float disparity_raw[kMax];
  alignas(64) float weight[kMax];  ///< 0 or 1
  std::size_t cell_begin[kCells + 1];
};

/// The linear least-squares problem of a body's six parameters: the disparity at the focus in raw units, two
/// rotations of the normal (about e2 and e1) and the three tangential curvatures.
struct BodyEquations {
  static constexpr int kParameters = 6;
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;

  double products[kProducts];  ///< upper triangle of the normal matrix, row by row
  double residuals[kParameters];
  double weight;                              ///< sum of the weights
  double square;                              ///< sum of the weighted squares of the residuals
  double cell_residual[BodySamples::kCells];  ///< sums of the weighted residuals
  double cell_weight[BodySamples::kCells];
  double explained;    ///< number of samples that belong to the body
  double unexplained;  ///< number of samples beside it, within BodyMeasure::beside_raw
};

/// How disparities belong to a body.
struct BodyMeasure {
  double focal_x_px;
  double focal_y_px;
  double a_per_m;  ///< of DisparityScale
  double b_per_m;
  double tolerance_raw;  ///< samples that differ by more do not belong to the body
  double beside_raw;     ///< those that differ by less than this belong to something that touches it
};

/// Sets up the equations of `body` for the samples, each weighted by (1 - (residual / tolerance)^2)^2.
/// RT: safe after the first call.  Cost: proportional to the number of samples.
BodyEquations equationsOf(const BodySamples& samples, const FocusBody& body,
                          const BodyMeasure& measure) noexcept;

}  // namespace hapticd::rt
