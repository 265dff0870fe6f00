// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "rt/parameters.h"

namespace hapticd::tools {

/// The pose of a rotation matrix and a translation in metres: the inverse of rt::rotationOf(). Roll and yaw
/// in -pi..pi, pitch in -pi/2..pi/2; where pitch is at an end and only the sum or difference of the others
/// matters, yaw is 0.
rt::PoseParameters poseOf(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_m);

}  // namespace hapticd::tools
