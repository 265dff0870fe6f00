// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/model_registration.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <numbers>

#include "rt/base/pose.h"
#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {
namespace {

using base::Error;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using rt::FixtureKind;
using rt::Vec3;

constexpr double kDegPerRad = 180 / std::numbers::pi;

Vector3d eigenOf(const Vec3& v) {
  return {v.x, v.y, v.z};
}
Vec3 vec3Of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Matrix3d matrixOf(const rt::PoseParameters& pose) {
  const std::array<double, 9> rows = rt::rotationOf(pose);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
}

/// T_world_model.
class Motion {
 public:
  explicit Motion(const rt::PoseParameters& pose)
      : rotation_(matrixOf(pose)), position_m_(eigenOf(pose.position_m)) {}

  Vec3 place(const Vec3& p) const { return vec3Of(rotation_ * eigenOf(p) + position_m_); }
  Vec3 direction(const Vec3& v) const { return vec3Of(rotation_ * eigenOf(v)); }
  Vec3 angles(const Vec3& angles_deg) const {
    const rt::PoseParameters own{
        {}, angles_deg.x / kDegPerRad, angles_deg.y / kDegPerRad, angles_deg.z / kDegPerRad};
    const rt::PoseParameters turned = poseOf(rotation_ * matrixOf(own), Vector3d::Zero());
    return {kDegPerRad * turned.roll_rad, kDegPerRad * turned.pitch_rad, kDegPerRad * turned.yaw_rad};
  }

 private:
  Matrix3d rotation_;
  Vector3d position_m_;
};

// A member that a kind does not use keeps its default, as config::FixtureSettings has it.

void move(config::FixtureSettings& fixture, const Motion& T_world_model) {
  if (fixture.kind == FixtureKind::standoff) return;
  for (Vec3& point : fixture.points_m) point = T_world_model.place(point);
  if (fixture.kind == FixtureKind::path) return;
  fixture.position_m = T_world_model.place(fixture.position_m);
  if (fixture.kind == FixtureKind::plane) fixture.normal = T_world_model.direction(fixture.normal);
  if (fixture.kind == FixtureKind::cone) fixture.axis = T_world_model.direction(fixture.axis);
  if (fixture.kind == FixtureKind::capsule) fixture.end_m = T_world_model.place(fixture.end_m);
  if (fixture.kind == FixtureKind::box) fixture.rotation_deg = T_world_model.angles(fixture.rotation_deg);
}

void move(config::RegionSettings& region, const Motion& T_world_model) {
  region.position_m = T_world_model.place(region.position_m);
  if (region.shape == rt::ShapeKind::capsule) region.end_m = T_world_model.place(region.end_m);
  if (region.shape == rt::ShapeKind::box) region.rotation_deg = T_world_model.angles(region.rotation_deg);
}

Error notOfTheModel(const char* noun, const std::string& name, const char* what) {
  return {fmt::format("{} {}", noun, name), fmt::format("{}, not in that of the model", what),
          "take it out of the file, and add it by itself"};
}

template <typename Item>
std::optional<Error> frameProblem(const char* noun, const Item& item) {
  if (item.frame == config::FixtureFrame::world) return std::nullopt;
  return notOfTheModel(noun, item.name, "it is in the frame of the camera");
}

Vec3 meanOf(std::span<const Vec3> points_m) {
  Vec3 sum;
  for (const Vec3& point : points_m) sum += point;
  return (1.0 / static_cast<double>(points_m.size())) * sum;
}

}  // namespace

base::Result<config::SceneAdditions> movedToWorld(const config::SceneAdditions& of_model,
                                                  const rt::PoseParameters& T_world_model) {
  const Motion motion(T_world_model);
  config::SceneAdditions moved = of_model;
  for (config::FixtureSettings& fixture : moved.fixtures) {
    if (auto problem = frameProblem("fixture", fixture)) return std::unexpected(std::move(*problem));
    move(fixture, motion);
  }
  for (config::RegionSettings& region : moved.regions) {
    if (region.place == rt::TissuePlace::label)
      return std::unexpected(notOfTheModel("region", region.name, "it is in the image of the camera"));
    if (auto problem = frameProblem("region", region)) return std::unexpected(std::move(*problem));
    move(region, motion);
  }
  return moved;
}

std::optional<Vec3> centreOf(const config::SceneAdditions& additions) {
  std::vector<Vec3> centres_m;
  for (const config::FixtureSettings& fixture : additions.fixtures) {
    if (fixture.kind == FixtureKind::standoff) continue;
    if (fixture.kind == FixtureKind::path) {
      centres_m.push_back(meanOf(fixture.points_m));
    } else if (fixture.kind == FixtureKind::capsule) {
      centres_m.push_back(0.5 * (fixture.position_m + fixture.end_m));
    } else {
      centres_m.push_back(fixture.position_m);
    }
  }
  for (const config::RegionSettings& region : additions.regions) {
    if (region.place == rt::TissuePlace::label) continue;
    const bool capsule = region.shape == rt::ShapeKind::capsule;
    centres_m.push_back(capsule ? 0.5 * (region.position_m + region.end_m) : region.position_m);
  }
  if (centres_m.empty()) return std::nullopt;
  return meanOf(centres_m);
}

double expectedTargetError_m(std::span<const PointPair> pairs, double rms_m, const Vec3& target_m_in_world) {
  const auto count = static_cast<double>(pairs.size());
  Vector3d centroid = Vector3d::Zero();
  for (const PointPair& pair : pairs) centroid += eigenOf(pair.world_m) / count;
  Matrix3d covariance = Matrix3d::Zero();
  for (const PointPair& pair : pairs) {
    const Vector3d off = eigenOf(pair.world_m) - centroid;
    covariance += off * off.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(covariance);
  const Vector3d along = principal.eigenvectors().transpose() * (eigenOf(target_m_in_world) - centroid);
  double sum = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double target_squared = along.squaredNorm() - along[k] * along[k];
    const double landmarks_squared = principal.eigenvalues().sum() - principal.eigenvalues()[k];
    sum += target_squared / landmarks_squared;
  }
  const double landmark_error_squared = rms_m * rms_m * count / (count - 2);
  return std::sqrt(landmark_error_squared / count * (1 + sum / 3));
}

}  // namespace hapticd::tools
