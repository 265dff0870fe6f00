// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/oracle/reference_camera.h"

#include <array>
#include <cmath>

#include "drivers/camera/kinect_image.h"

namespace hapticd::tools {
namespace {

using Long = long double;
using LongVector = std::array<Long, 3>;

LongVector aboutX(const LongVector& p, Long angle) {
  const Long c = std::cos(angle);
  const Long s = std::sin(angle);
  return {p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]};
}

LongVector aboutY(const LongVector& p, Long angle) {
  const Long c = std::cos(angle);
  const Long s = std::sin(angle);
  return {c * p[0] + s * p[2], p[1], c * p[2] - s * p[0]};
}

LongVector aboutZ(const LongVector& p, Long angle) {
  const Long c = std::cos(angle);
  const Long s = std::sin(angle);
  return {c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
}

PrintedMatrix printedMatrix(const rt::DepthModelParameters& m) {
  return {{
      {1 / Long(m.fx_px), 0, 0, 0},
      {0, -1 / Long(m.fy_px), 0, 0},
      {0, 0, 0, m.a_per_m},
      {-Long(m.cx_px) / m.fx_px, Long(m.cy_px) / m.fy_px, -1, m.b_per_m},
  }};
}

LongVector byPrintedMatrix(const PrintedMatrix& matrix, Long u, Long v, Long d) {
  const Long row_vector[4] = {u, v, d, 1};
  Long product[4] = {};
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t i = 0; i < 4; ++i) product[column] += row_vector[i] * matrix[i][column];
  }
  return {product[0] / product[3], product[1] / product[3], product[2] / product[3]};
}

rt::Vec3 rounded(const LongVector& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace

rt::Vec3 pointByPrintedMatrix(const rt::DepthModelParameters& parameters, double u, double v, double d) {
  return rounded(byPrintedMatrix(printedMatrix(parameters), u, v, d));
}

ReferenceCamera::ReferenceCamera(const rt::DepthModelParameters& parameters, const rt::PoseParameters& pose)
    : pose_(pose), matrix_(printedMatrix(parameters)) {
  for (std::size_t raw = 0; raw < accepts_.size(); ++raw) {
    const Long w = Long(parameters.a_per_m) * static_cast<Long>(raw) + parameters.b_per_m;
    accepts_[raw] = w > 0 && 1 / w >= parameters.near_m && 1 / w <= parameters.far_m;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    LongVector p{};
    p[axis] = 1;
    p = aboutZ(aboutY(aboutX(p, pose.roll_rad), pose.pitch_rad), pose.yaw_rad);
    for (std::size_t i = 0; i < 3; ++i) rotation_[i][axis] = p[i];
  }
}

bool ReferenceCamera::accepts(std::uint32_t raw) const {
  return raw < accepts_.size() && accepts_[raw];
}

rt::Vec3 ReferenceCamera::toWorld(const rt::Vec3& p_m_in_camera) const {
  const LongVector p{p_m_in_camera.x, p_m_in_camera.y, p_m_in_camera.z};
  const LongVector origin{pose_.position_m.x, pose_.position_m.y, pose_.position_m.z};
  LongVector world{};
  for (std::size_t i = 0; i < 3; ++i) {
    world[i] = rotation_[i][0] * p[0] + rotation_[i][1] * p[1] + rotation_[i][2] * p[2] + origin[i];
  }
  return rounded(world);
}

rt::Vec3 ReferenceCamera::pointInWorld(std::uint32_t column, std::uint32_t row, std::uint32_t raw) const {
  return toWorld(rounded(byPrintedMatrix(matrix_, column, row, raw)));
}

PointCloud ReferenceCamera::pointsOf(std::span<const std::uint16_t> raw) const {
  PointCloud cloud;
  cloud.points_m.reserve(drivers::kKinectPixels);
  for (std::vector<std::uint32_t>* const numbers : {&cloud.column, &cloud.row, &cloud.raw}) {
    numbers->reserve(drivers::kKinectPixels);
  }
  for (std::uint32_t row = 0; row < drivers::kKinectHeight; ++row) {
    for (std::uint32_t column = 0; column < drivers::kKinectWidth; ++column) {
      const std::uint32_t d = raw[row * drivers::kKinectWidth + column];
      if (!accepts(d)) continue;
      cloud.points_m.push_back(pointInWorld(column, row, d));
      cloud.column.push_back(column);
      cloud.row.push_back(row);
      cloud.raw.push_back(d);
    }
  }
  return cloud;
}

std::vector<rt::Vec3> pointsInCamera(std::span<const std::uint16_t> raw,
                                     const rt::DepthModelParameters& parameters) {
  return ReferenceCamera(parameters).pointsOf(raw).points_m;
}

}  // namespace hapticd::tools
