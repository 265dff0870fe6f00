// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// The pose of a rotation matrix and a translation in metres: the inverse of rt::rotationOf(). Roll and yaw
/// in -pi..pi, pitch in -pi/2..pi/2; where pitch is at an end and only the sum or difference of the others
/// matters, yaw is 0. rotation: column by column, as Eigen has it.
rt::PoseParameters poseOf(std::span<const double, 9> rotation, const rt::Vec3& translation_m);

/// A point in the camera frame and in the world frame.
struct PointPair {
  std::string name;
  rt::Vec3 camera_m;  ///< camera frame: x right, y up, looking along -z
  rt::Vec3 world_m;   ///< world frame
};

/// The rigid motion that fits pairs best.
struct RigidFit {
  rt::PoseParameters T_world_camera;
  std::vector<double> residuals_m;  ///< of each pair: distance between the point moved and where it should be
  double rms_m = 0;
  double largest_m = 0;
};

/// Pairs that a fit takes; two leave a turn about their line open.
inline constexpr std::size_t kMinPairs = 3;
/// Root mean square distance of the points from the line through them that the fit needs, so that a
/// millimetre of noise turns it by some degrees at most.
inline constexpr double kMinSpread_m = 0.01;

/// T_world_camera with the least sum of squared residuals, a turn and a shift without scale or reflection.
/// `whose`: points of the camera frame, for messages; another body, such as a model, can take its place.
/// Errors: fewer than kMinPairs, a number that is not finite, points on or nearly on a line.
/// Source: Umeyama, Least-squares estimation of transformation parameters between two point patterns, 1991,
/// eq. (39)-(41) with c = 1.
base::Result<RigidFit> fitRigid(std::span<const PointPair> pairs, const char* whose = "camera's");

}  // namespace hapticd::tools
