// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/pose_angles.h"

#include <cmath>

namespace hapticd::tools {
namespace {

/// Cosine of a pitch at which roll and yaw can no longer be told apart.
constexpr double kGimbalLock = 1e-9;

}  // namespace

rt::PoseParameters poseOf(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_m) {
  rt::PoseParameters pose;
  pose.position_m = {translation_m.x(), translation_m.y(), translation_m.z()};
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

}  // namespace hapticd::tools
