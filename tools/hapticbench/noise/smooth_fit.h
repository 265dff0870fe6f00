// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

namespace hapticd::tools {

/// A disparity at a place of a window; x and y from -1 to 1.
struct FitSample {
  double x;
  double y;
  double disparity;
};

/// disparity = c0 + c1 x + c2 y + c3 x^2 + c4 x y + c5 y^2, which a plane and a gently curved surface are.
struct SmoothSurface {
  std::array<double, 6> coefficients{};
  /// Standard deviation of the residuals by their median, raw units: outliers do not count.
  double deviation = 0;
  /// Share of the residuals above five times that and above 3 raw units.
  double outliers = 0;

  double at(double x, double y) const noexcept {
    const auto& c = coefficients;
    return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
  }
};

/// Least squares with Tukey's biweight, whose width follows the residuals' median.
SmoothSurface fitSmoothSurface(std::span<const FitSample> samples);

}  // namespace hapticd::tools
