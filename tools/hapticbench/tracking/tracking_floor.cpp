// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/hapticbench/tracking/tracking.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Rotations are in units of 1 m / kLength_m, which makes all six coordinates alike.
constexpr double kLength_m = 0.04;

/// A row of the model: how the distance of a point changes with the pose, in the solid's frame.
struct Row {
  Eigen::Matrix<double, 1, 6> slope;
  double sigma_m = 0;     // of the distance, by the noise
  double rounding_m = 0;  // of the distance, by rounding to raw values
  double column = 0;
  double row = 0;
};

std::vector<Row> rowsOf(const rt::DistanceGrid& grid, const rt::SolidPose& truth,
                        std::span<const rt::TrackingPoint> points, const rt::DepthModelParameters& camera,
                        double scale) {
  std::vector<Row> rows;
  const Vec3 eye_m = truth.placeIn({});
  constexpr double kGateSigmas = 5;
  for (const rt::TrackingPoint& point : points) {
    const Vec3 place_m = truth.placeIn(point.place_m);
    const rt::GridDistance found = distanceAt(grid, place_m);
    const Vec3 normal = (1 / norm(found.gradient)) * found.gradient;
    const double cosine = dot(normal, eye_m - place_m) / norm(eye_m - place_m);
    if (cosine < rt::kMinSightCosine) continue;
    if (std::abs(found.distance_m) > kGateSigmas * point.depth_sigma_m) continue;
    const double depth_m = -point.place_m.z;
    const double unit_m =
        camera.law == rt::DepthLawKind::linear ? camera.unit_m : std::abs(camera.a_per_m) * depth_m * depth_m;
    const Vec3 turn = (1 / kLength_m) * cross(place_m - found.distance_m * normal, normal);
    Row row;
    row.slope << turn.x, turn.y, turn.z, normal.x, normal.y, normal.z;
    row.sigma_m = scale * cosine * point.depth_sigma_m;
    row.rounding_m = cosine * unit_m / std::sqrt(12.0);
    row.column = camera.cx_px + camera.fx_px * point.place_m.x / depth_m;
    row.row = camera.cy_px - camera.fy_px * point.place_m.y / depth_m;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

double trackingFloor_m(const rt::DistanceGrid& grid, const rt::SolidPose& truth,
                       std::span<const rt::TrackingPoint> points, const rt::DepthModelParameters& camera,
                       double scale, const Vec3& target_m_in_solid) {
  const std::vector<Row> rows = rowsOf(grid, truth, points, camera, scale);
  const auto count = static_cast<Eigen::Index>(rows.size());
  constexpr double kUndetermined = std::numeric_limits<double>::infinity();
  if (count < 6) return kUndetermined;
  Eigen::MatrixXd covariance(count, count);
  Eigen::MatrixXd slopes(count, 6);
  const double correlation_px = camera.noise.correlation_px;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Row& a = rows[static_cast<std::size_t>(i)];
    slopes.row(i) = a.slope;
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Row& b = rows[static_cast<std::size_t>(j)];
      const double across = std::max(0.0, 1 - std::abs(a.column - b.column) / correlation_px);
      const double down = std::max(0.0, 1 - std::abs(a.row - b.row) / correlation_px);
      covariance(i, j) = covariance(j, i) = a.sigma_m * b.sigma_m * across * down;
    }
    covariance(i, i) += a.rounding_m * a.rounding_m;
  }
  const Eigen::Matrix<double, 6, 6> information = slopes.transpose() * covariance.llt().solve(slopes);
  // The normals of a grid differ a little from those of its solid, so that a motion that does not show seems
  // to.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(information);
  constexpr double kSmallest = 1e-4;
  const auto& eigenvalues = solver.eigenvalues();
  if (!(eigenvalues(0) > kSmallest * eigenvalues(5))) return kUndetermined;
  const Vec3 t = (1 / kLength_m) * target_m_in_solid;
  Eigen::Matrix<double, 3, 6> shift;
  shift << 0, t.z, -t.y, 1, 0, 0,  //
      -t.z, 0, t.x, 0, 1, 0,       //
      t.y, -t.x, 0, 0, 0, 1;
  const Eigen::Matrix<double, 3, 6> along = shift * solver.eigenvectors();
  return std::sqrt((along * eigenvalues.cwiseInverse().asDiagonal() * along.transpose()).trace());
}

}  // namespace hapticd::tools
