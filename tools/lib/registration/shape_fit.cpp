// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/shape_fit.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {
namespace {

using base::Error;
using Eigen::Vector3d;
using Points = Eigen::Matrix3Xd;

// Gauss-Newton steps; from the algebraic solution three or four reach the rounding of doubles.
constexpr int kMaxSteps = 50;
constexpr double kLastStep_m = 1e-12;

/// Root mean square distance of points from the plane through them below which a sphere is undetermined.
constexpr double kMinBulge_m = 2 * kTouchNoise_m;

Vector3d eigenOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}
rt::Vec3 vec3Of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// The centroid of points, and the directions in which they spread.
struct Spread {
  Vector3d centroid_m;
  Points centred;
  Vector3d rms_m;              ///< along the columns of `directions`, ascending
  Eigen::Matrix3d directions;  ///< unit vectors
};

Spread spreadOf(std::span<const rt::Vec3> points_m) {
  Points points(3, static_cast<Eigen::Index>(points_m.size()));
  for (std::size_t i = 0; i < points_m.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = eigenOf(points_m[i]);
  Spread spread;
  spread.centroid_m = points.rowwise().mean();
  spread.centred = points.colwise() - spread.centroid_m;
  const Eigen::Matrix3d covariance =
      spread.centred * spread.centred.transpose() / static_cast<double>(points.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  spread.rms_m = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  spread.directions = solver.eigenvectors();
  return spread;
}

base::Result<void> check(const char* shape, std::span<const rt::Vec3> points_m, std::size_t fewest) {
  if (points_m.size() < fewest) {
    return std::unexpected(Error{shape,
                                 fmt::format("{} points, at least {} are needed", points_m.size(), fewest),
                                 "touch more points"});
  }
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    if (!rt::isFinite(points_m[i])) {
      return std::unexpected(Error{shape, fmt::format("point {} is not finite", i + 1), "touch it again"});
    }
  }
  return {};
}

/// A sphere about the centroid of its points.
struct Ball {
  Vector3d centre_m;
  double radius_m = 0;
};

/// The sphere with the least sum of squared differences between the squares of distances and radius.
Ball algebraicFit(const Points& centred) {
  Eigen::MatrixX4d equations(centred.cols(), 4);
  equations << 2 * centred.transpose(), Eigen::VectorXd::Ones(centred.cols());
  const Eigen::Vector4d solution =
      equations.colPivHouseholderQr().solve(centred.colwise().squaredNorm().transpose());
  const Vector3d centre_m = solution.head<3>();
  return {centre_m, std::sqrt(std::max(solution[3] + centre_m.squaredNorm(), 0.0))};
}

/// Derivatives of the distances from a sphere by its centre and its radius.
Eigen::MatrixX4d derivativesOf(const Points& centred, const Ball& ball) {
  Eigen::MatrixX4d derivatives(centred.cols(), 4);
  for (Eigen::Index i = 0; i < centred.cols(); ++i) {
    derivatives.row(i) << (ball.centre_m - centred.col(i)).stableNormalized().transpose(), -1;
  }
  return derivatives;
}

Eigen::VectorXd distancesOf(const Points& centred, const Ball& ball) {
  return (centred.colwise() - ball.centre_m).colwise().norm().transpose().array() - ball.radius_m;
}

Ball refined(const Points& centred, Ball ball) {
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::Vector4d change =
        derivativesOf(centred, ball).colPivHouseholderQr().solve(-distancesOf(centred, ball));
    if (!change.allFinite()) break;
    ball.centre_m += change.head<3>();
    ball.radius_m += change[3];
    if (change.norm() < kLastStep_m) break;
  }
  return ball;
}

/// Standard deviation of the centre's and the radius's worst coordinate at kTouchNoise_m.
double expectedError_m(const Points& centred, const Ball& ball) {
  const Eigen::MatrixX4d derivatives = derivativesOf(centred, ball);
  const Eigen::FullPivLU<Eigen::Matrix4d> normal(derivatives.transpose() * derivatives);
  if (!normal.isInvertible()) return std::numeric_limits<double>::infinity();
  return kTouchNoise_m * std::sqrt(normal.inverse().diagonal().maxCoeff());
}

}  // namespace

Residuals residualsOf(std::span<const double> distances_m) {
  Residuals residuals;
  double squares = 0;
  for (const double distance_m : distances_m) {
    residuals.each_m.push_back(std::abs(distance_m));
    squares += distance_m * distance_m;
    residuals.largest_m = std::max(residuals.largest_m, std::abs(distance_m));
  }
  if (!distances_m.empty()) residuals.rms_m = std::sqrt(squares / static_cast<double>(distances_m.size()));
  return residuals;
}

base::Result<FittedPlane> fitPlane(std::span<const rt::Vec3> points_m, const rt::Vec3& free_side_m) {
  if (const auto good = check("plane", points_m, kMinPlanePoints); !good)
    return std::unexpected(good.error());
  const Spread spread = spreadOf(points_m);
  if (spread.rms_m[1] < kMinSpread_m) {
    return std::unexpected(
        Error{"plane",
              fmt::format("the points lie on a line: {:.1f} mm across it, at least {:.0f} mm are needed",
                          1000 * spread.rms_m[1], 1000 * kMinSpread_m),
              "touch points at the corners of a triangle as large as the plane"});
  }
  Vector3d normal = spread.directions.col(0);
  if (normal.dot(eigenOf(free_side_m) - spread.centroid_m) < 0) normal = -normal;
  const Eigen::VectorXd distances = spread.centred.transpose() * normal;
  return FittedPlane{vec3Of(spread.centroid_m), vec3Of(normal),
                     residualsOf({distances.data(), static_cast<std::size_t>(distances.size())})};
}

base::Result<FittedSphere> fitSphere(std::span<const rt::Vec3> points_m) {
  if (const auto good = check("sphere", points_m, kMinSpherePoints); !good)
    return std::unexpected(good.error());
  const Spread spread = spreadOf(points_m);
  if (spread.rms_m[0] < kMinBulge_m) {
    return std::unexpected(Error{
        "sphere",
        fmt::format("the points lie in a plane: {:.2f} mm out of it (root mean square), at least {:.0f} mm "
                    "are needed",
                    1000 * spread.rms_m[0], 1000 * kMinBulge_m),
        "touch the sphere at its top too, and as far down its sides as the handle reaches"});
  }
  const Ball ball = refined(spread.centred, algebraicFit(spread.centred));
  const double expected_error_m = expectedError_m(spread.centred, ball);
  // written so that a value that is not a number is refused
  if (!(expected_error_m <= kMaxSphereError_m && ball.radius_m > 0)) {
    return std::unexpected(Error{
        "sphere",
        fmt::format("the points cover so little of the sphere that noise of {} mm changes it by {:.1f} mm, "
                    "at most {:.0f} mm are allowed",
                    1000 * kTouchNoise_m, 1000 * expected_error_m, 1000 * kMaxSphereError_m),
        "touch points all around it, as far apart as the handle reaches"});
  }
  const Eigen::VectorXd distances = distancesOf(spread.centred, ball);
  return FittedSphere{vec3Of(spread.centroid_m + ball.centre_m), ball.radius_m,
                      residualsOf({distances.data(), static_cast<std::size_t>(distances.size())})};
}

base::Result<FittedBox> fitBox(const std::array<rt::Vec3, 3>& corners_m, const rt::Vec3& opposite_m) {
  const std::array all{corners_m[0], corners_m[1], corners_m[2], opposite_m};
  if (const auto good = check("box", all, all.size()); !good) return std::unexpected(good.error());
  const Vector3d corner = eigenOf(corners_m[1]);
  const Vector3d first = eigenOf(corners_m[0]) - corner;
  const Vector3d second = eigenOf(corners_m[2]) - corner;
  const auto tooShort = [](const char* what, double length_m) {
    return std::unexpected(
        Error{"box",
              fmt::format("{} is {:.1f} mm, at least {:.0f} mm can be measured by touch", what,
                          1000 * length_m, 1000 * kMinEdge_m),
              "touch the points again, or give its size in numbers with 'hapticctl fixture add'"});
  };
  if (first.norm() < kMinEdge_m) return tooShort("the edge from corner 1 to corner 2", first.norm());
  if (second.norm() < kMinEdge_m) return tooShort("the edge from corner 2 to corner 3", second.norm());

  const Vector3d sum = first.normalized() + second.normalized();
  const Vector3d difference = first.normalized() - second.normalized();
  if (std::min(sum.norm(), difference.norm()) < std::sqrt(2.0) / 4) {
    return std::unexpected(Error{"box", "the three corners lie nearly on a line",
                                 "touch three corners of one face in order along its edges"});
  }
  Eigen::Matrix3d axes;  // of the box, as columns
  axes.col(0) = (sum.normalized() + difference.normalized()).normalized();
  axes.col(1) = (sum.normalized() - difference.normalized()).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  const Vector3d edges(first.dot(axes.col(0)), second.dot(axes.col(1)),
                       (eigenOf(opposite_m) - corner).dot(axes.col(2)));  // the last with its sign
  if (std::abs(edges[2]) < kMinEdge_m)
    return tooShort("the distance to the opposite face", std::abs(edges[2]));

  const rt::PoseParameters pose =
      poseOf(std::span<const double, 9>(axes.data(), 9), vec3Of(corner + axes * edges / 2));
  const double degrees = 180 / std::numbers::pi;
  const std::array moved{(first - edges[0] * axes.col(0)).norm(), 0.0,
                         (second - edges[1] * axes.col(1)).norm()};
  return FittedBox{pose.position_m,
                   vec3Of(edges.cwiseAbs()),
                   {degrees * pose.roll_rad, degrees * pose.pitch_rad, degrees * pose.yaw_rad},
                   residualsOf(moved)};
}

}  // namespace hapticd::tools
