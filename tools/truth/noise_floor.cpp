#include "tools/truth/noise_floor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRoundingVariance = 1.0 / 12;

/// Correlation of the noise along one axis of the image.
MatrixXd windowCorrelation(int pixels) {
  MatrixXd correlation(pixels, pixels);
  for (int i = 0; i < pixels; ++i) {
    for (int j = 0; j < pixels; ++j) {
      correlation(i, j) = std::max(0.0, 1 - std::abs(i - j) / double{drivers::NoisePattern::kWindow});
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
      const double kept = patch.moving ? drivers::NoisePattern::standingCorrelation(noise, frames) : 1;
      covariance(i, j) = noise.standing_raw * noise.standing_raw * kept +
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

/// One axis of the image: the eigenvalues of the correlation, and 1, x and x^2 (x from -1 to 1, pixel's
/// middle) in its eigenvectors' base.
struct Axis {
  VectorXd eigenvalues;
  std::array<VectorXd, 3> powers;

  explicit Axis(int pixels) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(windowCorrelation(pixels));
    eigenvalues = solver.eigenvalues();
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
MatrixXd coefficientCovariance(const Axis& axis, const FrameModes& frames, Eigen::Index coefficients) {
  MatrixXd information = MatrixXd::Zero(coefficients, coefficients);
  const Eigen::Index pixels = axis.eigenvalues.size();
  for (Eigen::Index y = 0; y < pixels; ++y) {
    for (Eigen::Index x = 0; x < pixels; ++x) {
      const double correlation = axis.eigenvalues[x] * axis.eigenvalues[y];
      const double weight = (frames.weight.array() / (frames.noise.array() * correlation + 1)).sum();
      VectorXd row(coefficients);
      for (Eigen::Index i = 0; i < coefficients; ++i) {
        const Power power = kPowers[static_cast<std::size_t>(i)];
        row[i] = axis.powers[power.x][x] * axis.powers[power.y][y];
      }
      information += weight * row * row.transpose();
    }
  }
  return information.ldlt().solve(MatrixXd::Identity(coefficients, coefficients));
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
  const MatrixXd covariance = coefficientCovariance(axis, frames, is_plane ? 3 : 6);
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
