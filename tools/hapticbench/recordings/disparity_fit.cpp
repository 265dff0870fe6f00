// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/disparity_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tools/hapticbench/force_series.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr std::size_t kTerms = 6;
using Terms = std::array<double, kTerms>;

Terms termsAt(double x, double y) {
  return {1, x, y, x * x, x * y, y * y};
}

/// Normal equations of a weighted fit.
struct NormalEquations {
  std::array<Terms, kTerms> matrix{};
  Terms right{};

  void add(const Terms& terms, double value, double weight) {
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j < kTerms; ++j) matrix[i][j] += weight * terms[i] * terms[j];
      right[i] += weight * terms[i] * value;
    }
  }

  /// By elimination with pivots; nothing where the samples do not determine all terms.
  std::optional<Terms> solve() {
    for (std::size_t step = 0; step < kTerms; ++step) {
      std::size_t pivot = step;
      for (std::size_t row = step + 1; row < kTerms; ++row) {
        if (std::abs(matrix[row][step]) > std::abs(matrix[pivot][step])) pivot = row;
      }
      if (std::abs(matrix[pivot][step]) < 1e-9) return std::nullopt;
      std::swap(matrix[step], matrix[pivot]);
      std::swap(right[step], right[pivot]);
      for (std::size_t row = step + 1; row < kTerms; ++row) {
        const double factor = matrix[row][step] / matrix[step][step];
        for (std::size_t column = step; column < kTerms; ++column)
          matrix[row][column] -= factor * matrix[step][column];
        right[row] -= factor * right[step];
      }
    }
    Terms solution{};
    for (std::size_t row = kTerms; row-- > 0;) {
      double value = right[row];
      for (std::size_t column = row + 1; column < kTerms; ++column)
        value -= matrix[row][column] * solution[column];
      solution[row] = value / matrix[row][row];
    }
    return solution;
  }
};

/// Tukey's biweight: 1 in the middle, 0 from 4.685 standard deviations on.
double tukeyWeight(double residual, double deviation) {
  const double share = residual / (4.685 * deviation);
  return std::abs(share) >= 1 ? 0 : (1 - share * share) * (1 - share * share);
}

/// Standard deviation of normal residuals by the median of their magnitudes.
double robustDeviation(std::span<const double> residuals) {
  std::vector<double> magnitudes(residuals.begin(), residuals.end());
  for (double& magnitude : magnitudes) magnitude = std::abs(magnitude);
  return 1.4826 * quantile(std::move(magnitudes), 0.5);
}

}  // namespace

double DisparityQuadratic::at(double column, double row) const {
  const Terms terms = termsAt((column - middle_column) / half_px, (row - middle_row) / half_px);
  double raw = 0;
  for (std::size_t i = 0; i < kTerms; ++i) raw += coefficients[i] * terms[i];
  return raw;
}

std::optional<RobustFit> fitQuadratic(std::span<const DisparitySample> samples, double middle_column,
                                      double middle_row, double half_px) {
  constexpr int kRounds = 6;
  constexpr std::size_t kFewest = 30;
  constexpr double kFinestDeviation = 0.02;  // raw; below that rounding rules
  if (samples.size() < kFewest) return std::nullopt;
  RobustFit fit;
  fit.quadratic = {middle_column, middle_row, half_px, {}};
  std::vector<double> residuals(samples.size(), 0);
  double deviation = 0;
  for (int round = 0; round < kRounds; ++round) {
    NormalEquations equations;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const DisparitySample& sample = samples[i];
      const double weight = round == 0 ? 1 : tukeyWeight(residuals[i], deviation);
      equations.add(termsAt((sample.column - middle_column) / half_px, (sample.row - middle_row) / half_px),
                    sample.raw, weight);
    }
    const auto solution = equations.solve();
    if (!solution) return std::nullopt;
    fit.quadratic.coefficients = *solution;
    for (std::size_t i = 0; i < samples.size(); ++i)
      residuals[i] = samples[i].raw - fit.quadratic.at(samples[i].column, samples[i].row);
    deviation = std::max(robustDeviation(residuals), kFinestDeviation);
  }
  const auto outliers = std::ranges::count_if(
      residuals, [deviation](double residual) { return std::abs(residual) > 4 * deviation; });
  fit.residual_raw = deviation;
  fit.outlier_share = static_cast<double>(outliers) / static_cast<double>(samples.size());
  return fit;
}

Vec3 pointOf(const rt::DepthModelParameters& camera, double column, double row, double raw) {
  const double depth = 1 / (camera.a_per_m * raw + camera.b_per_m);
  return {depth * (column - camera.cx_px) / camera.fx_px, -depth * (row - camera.cy_px) / camera.fy_px,
          -depth};
}

SurfacePoint surfacePoint(const rt::DepthModelParameters& camera, const DisparityQuadratic& quadratic,
                          double column, double row) {
  constexpr double kStep_px = 0.5;
  const auto at = [&](double u, double v) { return pointOf(camera, u, v, quadratic.at(u, v)); };
  const Vec3 along_row = at(column + kStep_px, row) - at(column - kStep_px, row);
  const Vec3 along_column = at(column, row + kStep_px) - at(column, row - kStep_px);
  const Vec3 normal = cross(along_row, along_column);
  const Vec3 position = at(column, row);
  const double towards_camera = dot(normal, position) < 0 ? 1 : -1;
  return {position, (towards_camera / norm(normal)) * normal};
}

}  // namespace hapticd::tools
