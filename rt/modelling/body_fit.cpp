// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/body_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

namespace hapticd::rt {
namespace {

/// Half the sides of the windows.
constexpr std::array kRadius_m{0.014, 0.022, 0.034, 0.052, 0.08};
/// A smaller window does not determine a curvature.
constexpr double kLeastRadius_px = 6;
constexpr int kSteps = 2;
/// Standard deviation of a pixel, raw units of a Kinect v1.
constexpr double kNoise_raw = 0.56;
/// Side of the square of pixels that share one sample of the noise.
constexpr double kPatch_px = 9;
constexpr double kTolerance_sigma = 5;
/// Radius of curvature that bodies typically have; standard deviation of the curvature before anything is
/// known.
constexpr double kUsualRadius_m = 0.02;

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

Matrix6 matrixOf(const BodyEquations& equations) {
  Matrix6 matrix;
  int product = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column, ++product)
      matrix(row, column) = matrix(column, row) = equations.products[product];
  }
  return matrix;
}

double fallingStep(double x, double begin, double end) {
  const double t = std::clamp((x - begin) / (end - begin), 0.0, 1.0);
  return 1 - t * t * (3 - 2 * t);
}

/// Changes a body by its six parameters.
void change(FocusBody& body, const Vector6& by, double a_per_m) {
  body.inverse_depth_per_m += a_per_m * by[0];
  const Vec3 normal = body.normal + by[1] * body.tangent + by[2] * body.otherTangent();
  body.normal = (1 / norm(normal)) * normal;
  const Vec3 tangent = body.tangent - dot(body.tangent, body.normal) * body.normal;
  body.tangent = (1 / norm(tangent)) * tangent;
  body.curvature.along_1 += by[3];
  body.curvature.twist += by[4];
  body.curvature.along_2 += by[5];
  body.updateMatrix();
}

/// Returns by how much the curvatures change when planes, spheres and cylinders are preferred.
/// `curvature`: along e1, twist, along e2; `covariance`: its own; `prior`: variance before anything is known.
Vector3 preferred(const Vector3& curvature, const Matrix3& covariance, double prior) {
  const Matrix3 information = covariance.inverse();
  Vector3 sum = curvature;
  double weight = 1;
  const auto add = [&](const Vector3& model, double evidence) {
    sum += evidence * model;
    weight += evidence;
  };
  constexpr double kMost = 1e6;
  // Plane.
  const double flat = curvature.dot(information * curvature);
  add(Vector3::Zero(), std::min(kMost, std::sqrt(0.5 * prior * prior * prior / covariance.determinant()) *
                                           std::exp(-0.5 * flat)));
  // Sphere: equal curvatures, no twist.
  const Vector3 equal(1, 0, 1);
  const double mean = equal.dot(information * curvature) / equal.dot(information * equal);
  const Vector3 off_sphere = curvature - mean * equal;
  const Eigen::Matrix<double, 2, 3> unequal{{1, 0, -1}, {0, 2, 0}};
  const Eigen::Matrix2d of_unequal = unequal * covariance * unequal.transpose();
  add(mean * equal, std::min(kMost, std::sqrt(4 * prior * prior / of_unequal.determinant()) *
                                        std::exp(-0.5 * off_sphere.dot(information * off_sphere))));
  // Cylinder: the smaller of the principal curvatures is 0.
  const double middle = 0.5 * (curvature[0] + curvature[2]);
  const double half = 0.5 * (curvature[0] - curvature[2]);
  const double distance = std::hypot(half, curvature[1]);
  if (distance > 0) {
    const double smaller = middle >= 0 ? middle - distance : middle + distance;
    const double sign = middle >= 0 ? 1 : -1;
    // d(middle -+ distance) / d(along_1, twist, along_2)
    const Vector3 gradient(0.5 - sign * 0.5 * half / distance, -sign * curvature[1] / distance,
                           0.5 + sign * 0.5 * half / distance);
    const Vector3 spread = covariance * gradient;
    const double variance = gradient.dot(spread);
    add(curvature - (smaller / variance) * spread,
        std::min(kMost, std::sqrt(prior / variance) * std::exp(-0.5 * smaller * smaller / variance)));
  }
  return (1 / weight) * sum - curvature;
}

}  // namespace

FocusBody BodyFit::startOf(const ImagePosition& focus, const Facet& facet) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const DisparityScale& scale = model_.disparity();
  FocusBody body;
  body.column_px = focus.u;
  body.row_px = focus.v;
  body.ray_x = (focus.u - camera.cx_px) / camera.fx_px;
  body.ray_y = (focus.v - camera.cy_px) / camera.fy_px;
  body.inverse_depth_per_m = scale.inverseDepth_per_m(facet.disparity);
  const double x = scale.a_per_m * static_cast<double>(facet.per_column) * camera.fx_px;
  const double y = scale.a_per_m * static_cast<double>(facet.per_row) * camera.fy_px;
  const Vec3 plane{x, y, body.inverse_depth_per_m - x * body.ray_x - y * body.ray_y};
  body.normal = (-1 / norm(plane)) * plane;
  const Vec3 tangent = Vec3{1, 0, 0} - body.normal.x * body.normal;
  body.tangent = (1 / norm(tangent)) * tangent;
  body.curvature = {};
  body.updateMatrix();
  body.exists = body.inverse_depth_per_m > 0 && dot(body.normal, body.ray()) < 0;
  return body;
}

bool BodyFit::collect(const std::uint16_t* image, const PixelWindow& pixels, const FocusBody& body,
                      double radius_px) noexcept {
  constexpr int kSide = BodySamples::kCellsPerSide;
  constexpr int kHalf = BodySamples::kMaxPerSide / 2;
  const int stride = static_cast<int>(std::ceil(radius_px / kHalf));
  const int column_0 = static_cast<int>(std::lround(body.column_px));
  const int row_0 = static_cast<int>(std::lround(body.row_px));
  const int reach = static_cast<int>(radius_px) / stride;
  const int per_side = 2 * reach + 1;
  const double most = radius_px * radius_px;
  std::size_t count = 0;
  std::size_t seen = 0;
  for (int cell = 0; cell < BodySamples::kCells; ++cell) {
    samples_.cell_begin[cell] = count;
    const auto begin = [&](int i) { return i * per_side / kSide - reach; };
    for (int j = begin(cell / kSide); j < begin(cell / kSide + 1); ++j) {
      const int row = row_0 + j * stride;
      if (row < pixels.row_first || row > pixels.row_last) continue;
      const double dy = row - body.row_px;
      for (int i = begin(cell % kSide); i < begin(cell % kSide + 1); ++i) {
        const int column = column_0 + i * stride;
        if (column < pixels.column_first || column > pixels.column_last) continue;
        const double dx = column - body.column_px;
        if (dx * dx + dy * dy > most) continue;
        const std::uint16_t raw = image[row * model_.stride_px() + column];
        if (raw >= kNoRawDisparity) continue;
        samples_.column_px[count] = static_cast<float>(dx);
        samples_.row_px[count] = static_cast<float>(dy);
        samples_.disparity_raw[count] =
            static_cast<float>(raw) - shifts_.offsetOf(column / BlockLattice::kBlock_px);
        samples_.weight[count] = 1;
        ++count;
        ++seen;
      }
    }
    while (count % BodySamples::kAlignment != 0) {
      samples_.column_px[count] = samples_.row_px[count] = samples_.disparity_raw[count] = 0;
      samples_.weight[count++] = 0;
    }
  }
  samples_.cell_begin[BodySamples::kCells] = count;
  return seen > 0;
}

FocusBody BodyFit::fit(const std::uint16_t* image, const PixelWindow& pixels, const ImagePosition& focus,
                       const Facet& facet, double noise) noexcept {
  FocusBody result;
  if (facet.disparity < 0) return result;
  FocusBody start = startOf(focus, facet);
  if (!start.exists) return result;
  const DepthModelParameters& camera = model_.parameters();
  const DisparityScale& scale = model_.disparity();
  const double depth_m = 1 / start.inverse_depth_per_m;
  const double sigma = noise * kNoise_raw;
  const double unit_m = scale.unit_m(depth_m);
  BodyMeasure measure{camera.fx_px, camera.fy_px, scale.a_per_m, scale.b_per_m, kTolerance_sigma * sigma};
  const double prior = (depth_m / kUsualRadius_m) * (depth_m / kUsualRadius_m);
  double share = 1;
  bool first = true;
  FocusBody body = start;    // not shrunk, the start for the next window
  for (const double radius_m : kRadius_m) {
    const double radius_px = radius_m * camera.fx_px / depth_m;
    if (radius_px < kLeastRadius_px) continue;
    if (!collect(image, pixels, body, radius_px)) break;
    const double stride = std::ceil(radius_px / (BodySamples::kMaxPerSide / 2));
    const double per_patch = kPatch_px * kPatch_px / (stride * stride);
    FocusBody grown = body;
    BodyEquations equations{};
    Matrix6 inverse;
    const int steps = first ? kSteps + 2 : kSteps;
    for (int step = 0; step <= steps; ++step) {
      BodyMeasure now = measure;
      if (first) {
        // The start has no curvature.
        const double sag_m = 0.5 * radius_m * radius_m / 0.02;
        now.tolerance_raw += std::max(0.0, 1 - 0.5 * step) * sag_m / unit_m;
      }
      equations = equationsOf(samples_, grown, now);
      Matrix6 matrix = matrixOf(equations);
      Vector6 residuals;
      for (int i = 0; i < 6; ++i) residuals[i] = equations.residuals[i];
      const double information = sigma * sigma * per_patch / prior;
      for (int i = 3; i < 6; ++i) matrix(i, i) += information;
      residuals[3] -= information * grown.curvature.along_1;
      residuals[4] -= information * grown.curvature.twist;
      residuals[5] -= information * grown.curvature.along_2;
      matrix(0, 0) += 1e-9;
      matrix(1, 1) += 1e-9;
      matrix(2, 2) += 1e-9;
      inverse = matrix.inverse();
      if (step < steps) change(grown, inverse * residuals, scale.a_per_m);
    }
    // Do the residuals look like noise?
    double misfit = 0;
    for (int cell = 0; cell < BodySamples::kCells; ++cell) {
      const double weight = equations.cell_weight[cell];
      if (weight < 4) continue;
      const double mean = equations.cell_residual[cell] / weight;
      misfit += mean * mean / (sigma * sigma * std::min(1.0, per_patch / weight));
    }
    const double agrees = fallingStep(misfit, 9, 18) * (equations.weight * stride * stride > 60 ? 1 : 0);
    if (!(agrees > 0)) break;
    share *= agrees;
    // What the noise leaves open.
    const Matrix6 covariance = sigma * sigma * per_patch * inverse;
    const Matrix3 of_curvature = covariance.block<3, 3>(3, 3);
    const Vector3 curvature(grown.curvature.along_1, grown.curvature.twist, grown.curvature.along_2);
    Vector6 by;
    by.tail<3>() = preferred(curvature, of_curvature, prior);
    by.head<3>() = covariance.block<3, 3>(0, 3) * (of_curvature.inverse() * by.tail<3>());
    FocusBody chosen = grown;
    change(chosen, by, scale.a_per_m);
    if (first) {
      result = chosen;
      result.radius_px = share * radius_px;
    } else {
      // Both describe the same place; their parameters are averaged in the first one's basis.
      Vector6 difference;
      difference[0] = (chosen.inverse_depth_per_m - result.inverse_depth_per_m) / scale.a_per_m;
      difference[1] = dot(chosen.normal, result.tangent) / dot(chosen.normal, result.normal);
      difference[2] = dot(chosen.normal, result.otherTangent()) / dot(chosen.normal, result.normal);
      const Vec3 e = result.tangent;
      const Vec3 f = result.otherTangent();
      difference[3] = dot(e, chosen.a * e) - result.curvature.along_1;
      difference[4] = dot(e, chosen.a * f) - result.curvature.twist;
      difference[5] = dot(f, chosen.a * f) - result.curvature.along_2;
      change(result, share * difference, scale.a_per_m);
      result.radius_px += share * (radius_px - result.radius_px);
    }
    body = grown;
    first = false;
    if (share < 0.05) break;
  }
  if (first) return {};
  result.exists = true;
  result.tolerance_raw = measure.tolerance_raw;
  return result;
}

}  // namespace hapticd::rt
