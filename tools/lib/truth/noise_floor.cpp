// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/noise_floor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tools/lib/truth/body_scene.h"

namespace hapticd::tools {
namespace {

using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using rt::Vec3;

constexpr double kRoundingVariance = 1.0 / 12;

/// Covariance over frames of the part of the noise that is correlated over the window, raw units^2.
MatrixXd frameCovariance(const drivers::NoisePatternParameters& noise, const FloorFrames& seen) {
  MatrixXd covariance(seen.count, seen.count);
  for (int i = 0; i < seen.count; ++i) {
    for (int j = 0; j < seen.count; ++j) {
      const double apart = std::abs(i - j);
      const double kept = seen.moving ? drivers::NoisePattern::staticCorrelation(noise, apart) : 1;
      covariance(i, j) = noise.static_raw * noise.static_raw * kept +
                         noise.drift_raw * noise.drift_raw * std::exp(-apart / noise.drift_frames) +
                         (i == j ? noise.fast_raw * noise.fast_raw : 0);
    }
  }
  return covariance;
}

/// Covariance over frames of the rounding error, raw units^2: that of a value at a random phase within a unit
/// whose difference between two frames is normal (Fourier series of the rounding error).
MatrixXd roundingCovariance(const MatrixXd& noise, const FloorFrames& seen) {
  MatrixXd covariance = kRoundingVariance * MatrixXd::Identity(seen.count, seen.count);
  if (seen.moving) return covariance;  // a moving surface goes through all phases
  for (int i = 0; i < seen.count; ++i) {
    for (int j = 0; j < seen.count; ++j) {
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

/// Over the frames: with noise N and rounding R, vectors that make R one and N diagonal.
struct FrameModes {
  VectorXd noise;   ///< of each mode, where its rounding is 1
  VectorXd weight;  ///< of a constant in each mode, squared

  FrameModes(const drivers::NoisePatternParameters& parameters, const FloorFrames& seen) {
    const MatrixXd covariance = frameCovariance(parameters, seen);
    const MatrixXd rounding = roundingCovariance(covariance, seen);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(covariance, rounding);
    noise = solver.eigenvalues();
    weight = (solver.eigenvectors().transpose() * VectorXd::Ones(seen.count)).array().square();
  }
};

/// Returns the correlation of the noise of a matching window times an image, which is zero outside.
ArrayXXd correlated(const ArrayXXd& image, int window) {
  const auto along_rows = [window](const ArrayXXd& in) {
    ArrayXXd out = in;
    const int farthest = static_cast<int>(std::min<Index>(window, in.cols()));
    for (int apart = 1; apart < farthest; ++apart) {
      const double kept = 1 - apart / double(window);
      out.rightCols(in.cols() - apart) += kept * in.leftCols(in.cols() - apart);
      out.leftCols(in.cols() - apart) += kept * in.rightCols(in.cols() - apart);
    }
    return out;
  };
  const ArrayXXd turned = along_rows(image).transpose();
  return along_rows(turned).transpose();
}

/// The pixels of a rectangle that an estimate uses, and how their disparities depend on what is unknown.
struct Design {
  ArrayXXd used;                ///< 1 or 0
  std::vector<ArrayXXd> slope;  ///< raw units per unit of each unknown; 0 where not used

  /// `slopeAt(row, column)`: an optional array of what each unknown changes there; nothing: not used.
  template <std::size_t kUnknowns, typename SlopeAt>
  static Design of(Index rows, Index columns, const SlopeAt& slopeAt) {
    Design design{ArrayXXd::Zero(rows, columns),
                  std::vector<ArrayXXd>(kUnknowns, ArrayXXd::Zero(rows, columns))};
    for (Index column = 0; column < columns; ++column) {
      for (Index row = 0; row < rows; ++row) {
        const auto slopes = slopeAt(row, column);
        if (!slopes) continue;
        design.used(row, column) = 1;
        for (std::size_t i = 0; i < kUnknowns; ++i) design.slope[i](row, column) = (*slopes)[i];
      }
    }
    return design;
  }
  int pixels() const { return static_cast<int>(std::lround(used.sum())); }
};

/// Solves (noise * correlation + 1) x = `right` over the used pixels by conjugate gradients.
ArrayXXd whitened(const Design& design, double noise, const ArrayXXd& right) {
  constexpr double kAccuracy = 1e-9;  // of the residual
  constexpr int kMaxSteps = 2000;
  ArrayXXd x = ArrayXXd::Zero(right.rows(), right.cols());
  ArrayXXd residual = right;
  ArrayXXd direction = residual;
  double square = residual.square().sum();
  const double small = kAccuracy * kAccuracy * square;
  for (int step = 0; step < kMaxSteps && square > small; ++step) {
    const ArrayXXd image =
        direction + noise * design.used * correlated(direction, drivers::NoisePattern::kWindow);
    const double length = square / (direction * image).sum();
    x += length * direction;
    residual -= length * image;
    const double before = std::exchange(square, residual.square().sum());
    direction = residual + (square / before) * direction;
  }
  return x;
}

/// Covariance of what is unknown.
MatrixXd estimateCovariance(const Design& design, const FrameModes& frames, double coarse_raw) {
  const auto size = static_cast<Index>(design.slope.size());
  const double negligible = 1e-12 * frames.weight.maxCoeff();
  std::vector<ArrayXXd> weighted;
  for (const ArrayXXd& slope : design.slope) {
    ArrayXXd& sum = weighted.emplace_back(ArrayXXd::Zero(slope.rows(), slope.cols()));
    for (Index mode = 0; mode < frames.weight.size(); ++mode) {
      if (frames.weight[mode] <= negligible) continue;
      sum += frames.weight[mode] * whitened(design, frames.noise[mode], slope);
    }
  }
  MatrixXd information(size, size);
  MatrixXd distortion = MatrixXd::Zero(size, size);
  for (Index j = 0; j < size; ++j) {
    const ArrayXXd& of_j = weighted[static_cast<std::size_t>(j)];
    for (Index i = 0; i < size; ++i)
      information(i, j) = (design.slope[static_cast<std::size_t>(i)] * of_j).sum();
    if (coarse_raw == 0) continue;
    const ArrayXXd distorted = correlated(of_j, drivers::NoisePattern::kCoarseWindow);
    for (Index i = 0; i < size; ++i)
      distortion(i, j) = (weighted[static_cast<std::size_t>(i)] * distorted).sum();
  }
  const MatrixXd covariance = information.ldlt().solve(MatrixXd::Identity(size, size));
  return covariance + coarse_raw * coarse_raw * covariance * distortion * covariance;
}

/// Standard deviation of a linear function of what is unknown.
double deviation(const MatrixXd& covariance, const VectorXd& gradient) {
  return std::sqrt(gradient.dot(covariance * gradient));
}

FloorError undetermined() {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  return {.depth_m = kUnknown,
          .slope = kUnknown,
          .force_n = kUnknown,
          .force_jnd = kUnknown,
          .tilt_force_n = kUnknown};
}

/// What of a body is unknown: how its surface and the force move with it. Of a ball the centre along three
/// axes and the radius; of a rod the axis at the contact, sideways and its direction, and the radius.
class BodyModel {
 public:
  static constexpr std::size_t kMost = 5;

  explicit BodyModel(const FloorBody& body)
      : body_(body), centre_m_(body.contact_m - body.radius_m * body.outward) {
    const Vec3 aside = unitOf(body.axis ? cross(body.outward, *body.axis) : anyAcross(body.outward));
    across_ = {body.outward, aside};
    third_ = cross(body.outward, aside);
  }

  std::size_t unknowns() const { return body_.axis ? 5 : 4; }

  /// Raw units per metre (and radian) at the pixel whose ray is (x, y, -1); nothing where it is not used.
  std::optional<std::array<double, kMost>> slopes(const Vec3& ray,
                                                  const rt::DepthModelParameters& camera) const {
    const Vec3 ray_across = acrossAxis(ray);
    const Vec3 centre_across = acrossAxis(centre_m_);
    const double a = dot(ray_across, ray_across);
    const double b = dot(ray_across, centre_across);
    const double square = b * b - a * (dot(centre_across, centre_across) - body_.radius_m * body_.radius_m);
    if (square <= 0) return std::nullopt;
    const double depth_m = (b - std::sqrt(square)) / a;
    const Vec3 place = depth_m * ray;
    const Vec3 normal = (1 / body_.radius_m) * acrossAxis(place - centre_m_);
    const double facing = -dot(normal, ray);
    if (norm(place - body_.contact_m) > body_.window_m / 2) return std::nullopt;
    if (facing < std::cos(body_.max_incidence_rad) * norm(ray)) return std::nullopt;
    // out along the normal by 1 m, the surface comes nearer by 1 / facing
    const double raw_per_m = 1 / (camera.a_per_m * depth_m * depth_m * facing);
    const double first = raw_per_m * dot(normal, across_[0]);
    const double second = raw_per_m * dot(normal, across_[1]);
    if (!body_.axis) return std::array{first, second, raw_per_m * dot(normal, third_), raw_per_m, 0.0};
    const double from_contact_m = dot(place - centre_m_, *body_.axis);
    if (std::abs(from_contact_m) > body_.rod_length_m / 2) return std::nullopt;
    return std::array{first, second, from_contact_m * first, from_contact_m * second, raw_per_m};
  }

  /// How the position of the surface along the normal depends on what is unknown.
  VectorXd alongNormal() const {
    VectorXd gradient = VectorXd::Zero(static_cast<Index>(unknowns()));
    gradient[0] = 1;
    gradient[gradient.size() - 1] = 1;
    return gradient;
  }
  /// How the direction of the force on the HIP, along `body.along`, does.
  VectorXd alongSurface() const {
    VectorXd gradient = VectorXd::Zero(static_cast<Index>(unknowns()));
    const double from_axis_m = body_.radius_m - body_.depth_m;
    gradient[1] = -dot(across_[1], body_.along) / from_axis_m;
    gradient[2] = body_.axis ? -dot(*body_.axis, body_.along) : -dot(third_, body_.along) / from_axis_m;
    return gradient;
  }

 private:
  static Vec3 anyAcross(const Vec3& v) {
    return std::abs(v.x) < std::abs(v.y) ? cross(v, {1, 0, 0}) : cross(v, {0, 1, 0});
  }
  Vec3 acrossAxis(const Vec3& v) const { return body_.axis ? v - dot(v, *body_.axis) * *body_.axis : v; }

  const FloorBody& body_;
  Vec3 centre_m_;
  std::array<Vec3, 2> across_;  // of the directions in which the centre may be elsewhere
  Vec3 third_;                  // of a ball
};

}  // namespace

FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorPatch& patch, double stiffness_n_per_m) {
  const double pixels_per_m = camera.fx_px / patch.distance_m;
  const auto side_px = static_cast<Index>(std::lround(patch.side_m * pixels_per_m));
  if (side_px < 2) return undetermined();
  // x and y from -1 to 1 over the patch, at the pixels' middles
  const auto place = [side_px](Index pixel) {
    return (2 * static_cast<double>(pixel) + 1) / static_cast<double>(side_px) - 1;
  };
  const Design design = Design::of<3>(side_px, side_px, [&](Index row, Index column) {
    return std::optional(std::array{1.0, place(column), place(row)});
  });
  const FrameModes frames(noise.pattern, patch.frames);
  const MatrixXd covariance = estimateCovariance(design, frames, noise.pattern.coarse_raw);
  const double depth_per_raw = std::abs(camera.a_per_m) * patch.distance_m * patch.distance_m;
  const double half_side_m = 0.5 * static_cast<double>(side_px) / pixels_per_m;
  FloorError floor{.pixels = design.pixels(), .determined = true};
  floor.depth_m = depth_per_raw * deviation(covariance, Eigen::Vector3d(1, patch.off_centre, 0));
  floor.slope = depth_per_raw * deviation(covariance, Eigen::Vector3d(0, 1, 0)) / half_side_m;
  floor.force_n = stiffness_n_per_m * floor.depth_m;
  floor.force_jnd = floor.force_n / kForceJnd_n;
  floor.tilt_force_n = stiffness_n_per_m * kFloorPenetration_m * floor.slope;
  return floor;
}

namespace {

/// The pixels around the contact, as far as the window may reach in the image.
struct PixelWindow {
  Index first_column, first_row, columns, rows;

  PixelWindow(const FloorBody& body, const rt::DepthModelParameters& camera) {
    const double depth_m = -body.contact_m.z;
    const double nearest_m = std::max(depth_m - body.window_m / 2, 0.1 * depth_m);
    const double reach_m = body.axis ? body.window_m / 2 : std::min(body.window_m / 2, 2 * body.radius_m);
    const auto [first_x, last_x] =
        range(body.contact_m.x / depth_m, reach_m / nearest_m, camera.fx_px, camera.cx_px, camera.width_px);
    const auto [first_y, last_y] =
        range(-body.contact_m.y / depth_m, reach_m / nearest_m, camera.fy_px, camera.cy_px, camera.height_px);
    first_column = first_x;
    first_row = first_y;
    columns = std::max<Index>(0, last_x - first_x + 1);
    rows = std::max<Index>(0, last_y - first_y + 1);
  }

 private:
  static std::pair<Index, Index> range(double slope, double reach, double f_px, double c_px, int pixels) {
    const auto first = static_cast<Index>(std::floor(c_px + (slope - reach) * f_px));
    const auto last = static_cast<Index>(std::ceil(c_px + (slope + reach) * f_px));
    return {std::max<Index>(0, first), std::min<Index>(pixels - 1, last)};
  }
};

}  // namespace

FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorBody& body, double stiffness_n_per_m) {
  const BodyModel model(body);
  const PixelWindow window(body, camera);
  Design design = Design::of<BodyModel::kMost>(window.rows, window.columns, [&](Index row, Index column) {
    const double x = (static_cast<double>(window.first_column + column) - camera.cx_px) / camera.fx_px;
    const double y = (static_cast<double>(window.first_row + row) - camera.cy_px) / camera.fy_px;
    return model.slopes({x, -y, -1}, camera);
  });
  design.slope.resize(model.unknowns());
  if (design.pixels() <= static_cast<int>(model.unknowns())) return undetermined();
  const FrameModes frames(noise.pattern, body.frames);
  const MatrixXd covariance = estimateCovariance(design, frames, noise.pattern.coarse_raw);
  FloorError floor{.pixels = design.pixels(), .determined = true};
  floor.depth_m = deviation(covariance, model.alongNormal());
  floor.force_n = stiffness_n_per_m * floor.depth_m;
  floor.force_jnd = floor.force_n / kForceJnd_n;
  floor.tilt_force_n = stiffness_n_per_m * body.depth_m * deviation(covariance, model.alongSurface());
  return floor;
}

}  // namespace hapticd::tools
