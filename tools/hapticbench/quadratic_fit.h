// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>

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

}  // namespace hapticd::tools
