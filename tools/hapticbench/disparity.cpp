// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/disparity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tools/hapticbench/engine/measures.h"
#include "tools/lib/depth_noise/depth_noise.h"
#include "tools/lib/truth/body_scene.h"

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

CameraDisparity::CameraDisparity(const rt::DepthModelParameters& camera)
    : model_(camera, {}),
      of_raw_(std::numeric_limits<std::uint16_t>::max() + std::size_t{1},
              std::numeric_limits<float>::quiet_NaN()) {
  for (std::uint32_t value = 0; value < camera.raw_values; ++value) {
    const auto raw = static_cast<std::uint16_t>(value);
    if (!model_.isMeasurement(raw)) continue;
    if (model_.rawIsDisparity()) {
      of_raw_[raw] = raw;
    } else if (const double depth_m = model_.depthOfReal_m(raw); depth_m > 0) {
      of_raw_[raw] = static_cast<float>(ofDepth(depth_m));
    }
  }
}

rt::Vec3 CameraDisparity::pointOf(double column, double row, double disparity) const {
  const rt::DepthModelParameters& camera = model_.parameters();
  const double depth = depth_m(disparity);
  return {depth * (column - camera.cx_px) / camera.fx_px, -depth * (row - camera.cy_px) / camera.fy_px,
          -depth};
}

double CameraDisparity::changingNoise(double disparity) const {
  const rt::DepthNoiseParameters& noise = model_.parameters().noise;
  const double depth = depth_m(disparity);
  if (!noise.isKnown() || !(depth > 0)) return 0;
  return std::sqrt(1 - noise.standing_share) * noise.sigma_m(depth) / unit_m(depth);
}

rt::DepthModelParameters cameraWithNoise(const BenchSequence& sequence) {
  rt::DepthModelParameters camera = sequence.camera();
  if (camera.noise.isKnown() || isKinect(camera)) return camera;
  DepthNoise measured;
  for (const auto& frame : sequence.frames) measured.add(*frame);
  const DepthNoiseReport report = measured.report();
  if (const auto noise = fittedNoise(report.at_depths, camera.principle)) {
    camera.noise = *noise;
    camera.noise.correlation_px = report.correlation_px;
  }
  return camera;
}

using rt::Vec3;

std::optional<RobustFit> fitDisparity(std::span<const DisparitySample> samples, double middle_column,
                                      double middle_row, double half_px) {
  constexpr std::size_t kMin = 30;
  constexpr QuadraticFitOptions kOptions{.rounds = 6, .least_deviation = 0.02, .outlier_deviations = 4};
  if (samples.size() < kMin) return std::nullopt;
  std::vector<QuadraticSample> scaled;
  for (const DisparitySample& sample : samples) {
    scaled.push_back(
        {(sample.column - middle_column) / half_px, (sample.row - middle_row) / half_px, sample.raw});
  }
  const auto fit = fitQuadratic(scaled, kOptions);
  if (!fit) return std::nullopt;
  return RobustFit{{middle_column, middle_row, half_px, fit->quadratic}, fit->deviation, fit->outlier_share};
}

SurfacePoint surfacePoint(const CameraDisparity& camera, const DisparityQuadratic& quadratic, double column,
                          double row) {
  constexpr double kStep_px = 0.5;
  const auto at = [&](double u, double v) { return camera.pointOf(u, v, quadratic.at(u, v)); };
  const Vec3 along_row = at(column + kStep_px, row) - at(column - kStep_px, row);
  const Vec3 along_column = at(column, row + kStep_px) - at(column, row - kStep_px);
  const Vec3 normal = cross(along_row, along_column);
  const Vec3 position = at(column, row);
  const double towards_camera = dot(normal, position) < 0 ? 1 : -1;
  return {position, (towards_camera / norm(normal)) * normal};
}

}  // namespace hapticd::tools
