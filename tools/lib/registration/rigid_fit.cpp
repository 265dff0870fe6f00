// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/rigid_fit.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace hapticd::tools {
namespace {

/// Cosine of a pitch at which roll and yaw can no longer be told apart.
constexpr double kGimbalLock = 1e-9;

}  // namespace

rt::PoseParameters poseOf(std::span<const double, 9> columns, const rt::Vec3& translation_m) {
  const Eigen::Map<const Eigen::Matrix3d> rotation(columns.data());
  rt::PoseParameters pose;
  pose.position_m = translation_m;
  const double cosine_of_pitch = std::hypot(rotation(0, 0), rotation(1, 0));
  pose.pitch_rad = std::atan2(-rotation(2, 0), cosine_of_pitch);
  if (cosine_of_pitch < kGimbalLock) {
    pose.roll_rad = std::atan2(-rotation(1, 2), rotation(1, 1));
  } else {
    pose.roll_rad = std::atan2(rotation(2, 1), rotation(2, 2));
    pose.yaw_rad = std::atan2(rotation(1, 0), rotation(0, 0));
  }
  return pose;
}

namespace {

using base::Error;
using Points = Eigen::Matrix3Xd;

Eigen::Vector3d eigenOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}

Points pointsOf(std::span<const PointPair> pairs, rt::Vec3 PointPair::*side) {
  Points points(3, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = eigenOf(pairs[i].*side);
  }
  return points;
}

/// Root mean square distance of centred points from the line that fits them best.
double spreadAcrossALine_m(const Points& centred) {
  const Eigen::Vector3d singular = (centred * centred.transpose()).jacobiSvd().singularValues();
  return std::sqrt((singular[1] + singular[2]) / static_cast<double>(centred.cols()));
}

base::Result<void> check(const Points& centred, const char* whose) {
  const double spread_m = spreadAcrossALine_m(centred);
  if (spread_m >= kMinSpread_m) return {};
  return std::unexpected(
      Error{"registration",
            fmt::format("the {} points lie on a line: {:.1f} mm across it, at least {:.0f} mm are needed",
                        whose, 1000 * spread_m, 1000 * kMinSpread_m),
            "take points at the corners of a triangle as large as the scene"});
}

base::Result<void> check(std::span<const PointPair> pairs) {
  if (pairs.size() < kMinPairs) {
    return std::unexpected(
        Error{"registration", fmt::format("{} point pairs, at least {} are needed", pairs.size(), kMinPairs),
              "add pairs that do not lie on one line"});
  }
  for (const PointPair& pair : pairs) {
    if (!rt::isFinite(pair.camera_m) || !rt::isFinite(pair.world_m)) {
      return std::unexpected(Error{pair.name, "a coordinate is not finite", "measure that point again"});
    }
  }
  return {};
}

/// The turn from centred camera points to centred world points.
Eigen::Matrix3d turnBetween(const Points& camera, const Points& world) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(world * camera.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  // the best orthogonal matrix may be a reflection; the best turn differs in its weakest direction
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs[2] = -1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

base::Result<RigidFit> fitRigid(std::span<const PointPair> pairs, const char* whose) {
  if (const auto good = check(pairs); !good) return std::unexpected(good.error());
  const Points camera = pointsOf(pairs, &PointPair::camera_m);
  const Points world = pointsOf(pairs, &PointPair::world_m);
  const Eigen::Vector3d camera_mean = camera.rowwise().mean();
  const Eigen::Vector3d world_mean = world.rowwise().mean();
  const Points camera_centred = camera.colwise() - camera_mean;
  const Points world_centred = world.colwise() - world_mean;
  if (const auto good = check(camera_centred, whose); !good) return std::unexpected(good.error());
  if (const auto good = check(world_centred, "world's"); !good) return std::unexpected(good.error());

  const Eigen::Matrix3d turn = turnBetween(camera_centred, world_centred);
  const Eigen::Vector3d shift = world_mean - turn * camera_mean;
  const Eigen::VectorXd residuals = ((turn * camera).colwise() + shift - world).colwise().norm();

  RigidFit fit;
  fit.T_world_camera = poseOf(std::span<const double, 9>(turn.data(), 9), {shift.x(), shift.y(), shift.z()});
  fit.residuals_m.assign(residuals.begin(), residuals.end());
  fit.rms_m = std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size()));
  fit.largest_m = residuals.maxCoeff();
  return fit;
}

}  // namespace hapticd::tools
