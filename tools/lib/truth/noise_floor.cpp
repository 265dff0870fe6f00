// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/noise_floor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace hapticd::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRoundingVariance = 1.0 / 12;

/// Correlation of the noise along one axis of the image.
MatrixXd windowCorrelation(int pixels, int window) {
  MatrixXd correlation(pixels, pixels);
  for (int i = 0; i < pixels; ++i) {
    for (int j = 0; j < pixels; ++j) {
      correlation(i, j) = std::max(0.0, 1 - std::abs(i - j) / double(window));
    }
  }
  return correlation;
}

/// Covariance over frames of the part of the noise that is correlated over the window, raw units^2.
MatrixXd frameCovariance(const drivers::NoisePatternParameters& noise, const FloorPatch& patch) {
  MatrixXd covariance(patch.frames, patch.frames);
  for (int i = 0; i < patch.frames; ++i) {
    for (int j = 0; j < patch.frames; ++j) {
      const double frames = std::abs(i - j);
      const double kept = patch.moving ? drivers::NoisePattern::staticCorrelation(noise, frames) : 1;
      covariance(i, j) = noise.static_raw * noise.static_raw * kept +
                         noise.drift_raw * noise.drift_raw * std::exp(-frames / noise.drift_frames) +
                         (i == j ? noise.fast_raw * noise.fast_raw : 0);
    }
  }
  return covariance;
}

/// Covariance over frames of the rounding error, raw units^2: that of a value at a random phase within a unit
/// whose difference between two frames is normal (Fourier series of the rounding error).
MatrixXd roundingCovariance(const MatrixXd& noise, const FloorPatch& patch) {
  MatrixXd covariance = kRoundingVariance * MatrixXd::Identity(patch.frames, patch.frames);
  if (patch.moving) return covariance;  // a moving surface goes through all phases
  for (int i = 0; i < patch.frames; ++i) {
    for (int j = 0; j < patch.frames; ++j) {
      if (i == j) continue;
      const double change_variance = noise(i, i) + noise(j, j) - 2 * noise(i, j);
      covariance(i, j) = 0;
      for (int k = 1; k <= 8; ++k) {
        const double wave = std::numbers::pi * k;
        covariance(i, j) += std::exp(-2 * wave * wave * change_variance) / (2 * wave * wave);
      }
    }
  }
  return covariance;
}

/// One axis of the image: the eigenvalues of the noise's correlation; in its eigenvectors' base 1, x and x^2
/// (x from -1 to 1, pixel's middle) and the correlation of the distortion.
struct Axis {
  VectorXd eigenvalues;
  MatrixXd coarse;
  std::array<VectorXd, 3> powers;

  explicit Axis(int pixels) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(
        windowCorrelation(pixels, drivers::NoisePattern::kWindow));
    eigenvalues = solver.eigenvalues();
    coarse = solver.eigenvectors().transpose() *
             windowCorrelation(pixels, drivers::NoisePattern::kCoarseWindow) * solver.eigenvectors();
    const VectorXd x = VectorXd::LinSpaced(pixels, -1.0 + 1.0 / pixels, 1.0 - 1.0 / pixels);
    powers[0] = solver.eigenvectors().transpose() * VectorXd::Ones(pixels);
    powers[1] = solver.eigenvectors().transpose() * x;
    powers[2] = solver.eigenvectors().transpose() * x.cwiseProduct(x);
  }
};

/// Over the frames: with noise N and rounding R, vectors that make R one and N diagonal.
struct FrameModes {
  VectorXd noise;   ///< of each mode, where its rounding is 1
  VectorXd weight;  ///< of a constant in each mode, squared

  FrameModes(const drivers::NoisePatternParameters& parameters, const FloorPatch& patch) {
    const MatrixXd covariance = frameCovariance(parameters, patch);
    const MatrixXd rounding = roundingCovariance(covariance, patch);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(covariance, rounding);
    noise = solver.eigenvalues();
    weight = (solver.eigenvectors().transpose() * VectorXd::Ones(patch.frames)).array().square();
  }
};

struct Power {
  std::size_t x;
  std::size_t y;
};
constexpr std::array<Power, 6> kPowers{{{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}};

/// Covariance of the coefficients of the model, raw units^2 with x and y from -1 to 1 over the patch.
MatrixXd coefficientCovariance(const Axis& axis, const FrameModes& frames, double coarse_raw,
                               std::size_t coefficients) {
  const Eigen::Index pixels = axis.eigenvalues.size();
  MatrixXd weights(pixels, pixels);  // of a pixel's mode, over all frames
  for (Eigen::Index y = 0; y < pixels; ++y) {
    for (Eigen::Index x = 0; x < pixels; ++x) {
      const double correlation = axis.eigenvalues[x] * axis.eigenvalues[y];
      weights(y, x) = (frames.weight.array() / (frames.noise.array() * correlation + 1)).sum();
    }
  }
  std::vector<MatrixXd> shapes;    // of the coefficients
  std::vector<MatrixXd> weighted;  // what a pixel adds to them, before they are separated
  for (std::size_t i = 0; i < coefficients; ++i) {
    shapes.emplace_back(axis.powers[kPowers[i].y] * axis.powers[kPowers[i].x].transpose());
    weighted.emplace_back(weights.cwiseProduct(shapes.back()));
  }
  const auto size = static_cast<Eigen::Index>(coefficients);
  MatrixXd information(size, size);
  MatrixXd distortion(size, size);
  for (std::size_t j = 0; j < coefficients; ++j) {
    const MatrixXd distorted = axis.coarse * weighted[j] * axis.coarse;
    for (std::size_t i = 0; i < coefficients; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(j);
      information(row, column) = shapes[i].cwiseProduct(weighted[j]).sum();
      distortion(row, column) = weighted[i].cwiseProduct(distorted).sum();
    }
  }
  const MatrixXd covariance = information.ldlt().solve(MatrixXd::Identity(size, size));
  return covariance + coarse_raw * coarse_raw * covariance * distortion * covariance;
}

}  // namespace

FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorPatch& patch, double stiffness_n_per_m) {
  FloorError floor;
  const double pixels_per_m = camera.fx_px / patch.distance_m;
  floor.side_px = static_cast<int>(std::lround(patch.side_m * pixels_per_m));
  const bool is_plane = patch.model == FloorModel::plane;
  floor.determined = floor.side_px >= (is_plane ? 2 : 3);
  if (!floor.determined) {
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    floor.depth_m = floor.slope = floor.force_n = floor.force_jnd = floor.tilt_force_n = kUnknown;
    return floor;
  }
  const Axis axis(floor.side_px);
  const FrameModes frames(noise.pattern, patch);
  const MatrixXd covariance = coefficientCovariance(axis, frames, noise.pattern.coarse_raw, is_plane ? 3 : 6);
  const double depth_per_raw = std::abs(camera.a_per_m) * patch.distance_m * patch.distance_m;
  const double half_side_m = 0.5 * floor.side_px / pixels_per_m;
  floor.depth_m = depth_per_raw * std::sqrt(covariance(0, 0));
  floor.slope = depth_per_raw * std::sqrt(covariance(1, 1)) / half_side_m;
  floor.force_n = stiffness_n_per_m * floor.depth_m;
  floor.force_jnd = floor.force_n / kForceJnd_n;
  floor.tilt_force_n = stiffness_n_per_m * kFloorPenetration_m * floor.slope;
  return floor;
}

}  // namespace hapticd::tools
