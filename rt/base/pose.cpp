// SPDX-License-Identifier: Apache-2.0
#include "rt/base/pose.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hapticd::rt {

std::array<double, 9> rotationOf(const PoseParameters& pose) {
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(pose.yaw_rad, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(pose.pitch_rad, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(pose.roll_rad, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  std::array<double, 9> rows;
  for (int i = 0; i < 9; ++i) rows[static_cast<std::size_t>(i)] = rotation(i / 3, i % 3);
  return rows;
}

}  // namespace hapticd::rt
