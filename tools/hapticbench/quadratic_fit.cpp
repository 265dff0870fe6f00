// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/quadratic_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {
namespace {

using Coefficients = Eigen::Matrix<double, 6, 1>;
using NormalMatrix = Eigen::Matrix<double, 6, 6>;

Coefficients powersOf(const QuadraticSample& sample) {
  Coefficients powers;
  powers << 1, sample.x, sample.y, sample.x * sample.x, sample.x * sample.y, sample.y * sample.y;
  return powers;
}

double biweight(double residual, double deviation) {
  constexpr double kWidth = 4.685;  // in deviations: 95 % efficient on normal residuals
  const double u = residual / (kWidth * deviation);
  return std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
}

}  // namespace

std::optional<QuadraticFit> fitQuadratic(std::span<const QuadraticSample> samples,
                                         const QuadraticFitOptions& options) {
  constexpr double kUndetermined = 1e-9;
  QuadraticFit fit;
  std::vector<double> weights(samples.size(), 1);
  std::vector<double> residuals(samples.size());
  for (int round = 0; round < options.rounds; ++round) {
    NormalMatrix normal = NormalMatrix::Zero();
    Coefficients right = Coefficients::Zero();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Coefficients powers = powersOf(samples[i]);
      normal += weights[i] * powers * powers.transpose();
      right += weights[i] * samples[i].value * powers;
    }
    const Eigen::LDLT<NormalMatrix> solver(normal);
    if (solver.vectorD().cwiseAbs().minCoeff() < kUndetermined) return std::nullopt;
    const Coefficients solution = solver.solve(right);
    std::copy_n(solution.data(), 6, fit.quadratic.coefficients.begin());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      residuals[i] = samples[i].value - fit.quadratic.at(samples[i].x, samples[i].y);
    }
    fit.deviation = std::max(robustDeviation(residuals), options.least_deviation);
    for (std::size_t i = 0; i < samples.size(); ++i) weights[i] = biweight(residuals[i], fit.deviation);
  }
  const double far = std::max(options.outlier_deviations * fit.deviation, options.least_outlier);
  const auto outliers =
      std::ranges::count_if(residuals, [far](double residual) { return std::abs(residual) > far; });
  fit.outlier_share = static_cast<double>(outliers) / static_cast<double>(samples.size());
  return fit;
}

}  // namespace hapticd::tools
