// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/smooth_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr int kRounds = 8;
constexpr double kBiweightWidth = 4.685;  // in deviations: 95 % efficient on normal residuals
constexpr double kLeastDeviation = 0.05;  // raw units; rounding alone leaves 0.29
constexpr double kFarDeviations = 5;
constexpr double kFarRaw = 3;

using Coefficients = Eigen::Matrix<double, 6, 1>;

Coefficients powersOf(const FitSample& sample) {
  Coefficients powers;
  powers << 1, sample.x, sample.y, sample.x * sample.x, sample.x * sample.y, sample.y * sample.y;
  return powers;
}

double biweight(double residual, double deviation) {
  const double u = residual / (kBiweightWidth * deviation);
  return std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
}

}  // namespace

SmoothSurface fitSmoothSurface(std::span<const FitSample> samples) {
  SmoothSurface surface;
  std::vector<double> weights(samples.size(), 1);
  std::vector<double> residuals(samples.size());
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Coefficients right = Coefficients::Zero();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Coefficients powers = powersOf(samples[i]);
      normal += weights[i] * powers * powers.transpose();
      right += weights[i] * samples[i].disparity * powers;
    }
    const Coefficients solution = normal.ldlt().solve(right);
    std::copy_n(solution.data(), 6, surface.coefficients.begin());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      residuals[i] = samples[i].disparity - surface.at(samples[i].x, samples[i].y);
    }
    std::vector<double> sizes(residuals.size());
    std::ranges::transform(residuals, sizes.begin(), [](double residual) { return std::abs(residual); });
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    constexpr double kNormalDeviation = 1.4826;  // of a normal distribution whose median size is one
    surface.deviation = std::max(kNormalDeviation * *middle, kLeastDeviation);
    for (std::size_t i = 0; i < samples.size(); ++i) weights[i] = biweight(residuals[i], surface.deviation);
  }
  const double far = std::max(kFarDeviations * surface.deviation, kFarRaw);
  const auto outliers =
      std::ranges::count_if(residuals, [far](double residual) { return std::abs(residual) > far; });
  surface.outliers = static_cast<double>(outliers) / static_cast<double>(samples.size());
  return surface;
}

}  // namespace hapticd::tools
