// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/oracle/reference_camera.h"

#include <array>
#include <cmath>
#include <stdexcept>

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

/// Eq. (2) with the depth itself in place of a disparity.
LongVector onRay(const rt::DepthModelParameters& m, Long u, Long v, Long depth_m) {
  return {(u - m.cx_px) / m.fx_px * depth_m, -(v - m.cy_px) / m.fy_px * depth_m, -depth_m};
}

rt::Vec3 rounded(const LongVector& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

/// Whether a raw value is a measurement within the limits. A depth that is a multiple of the unit may be the
/// limit itself; both are numbers of double precision.
bool isWithin(const rt::DepthModelParameters& m, std::uint32_t raw) {
  if (raw == m.raw_no_measurement) return false;
  if (m.law == rt::DepthLawKind::linear) {
    const double depth_m = m.unit_m * raw;
    return depth_m >= m.near_m && depth_m <= m.far_m;
  }
  const Long w = Long(m.a_per_m) * static_cast<Long>(raw) + m.b_per_m;
  return w > 0 && 1 / w >= m.near_m && 1 / w <= m.far_m;
}

}  // namespace

rt::Vec3 pointByPrintedMatrix(const rt::DepthModelParameters& parameters, double u, double v, double d) {
  return rounded(byPrintedMatrix(printedMatrix(parameters), u, v, d));
}

ReferenceCamera::ReferenceCamera(const rt::DepthModelParameters& parameters, const rt::PoseParameters& pose)
    : camera_(parameters), pose_(pose), matrix_(printedMatrix(parameters)) {
  for (std::uint32_t raw = 0; raw < parameters.raw_values; ++raw)
    accepts_.push_back(isWithin(parameters, raw));
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
  const bool is_linear = camera_.law == rt::DepthLawKind::linear;
  return toWorld(rounded(is_linear ? onRay(camera_, column, row, Long(camera_.unit_m) * raw)
                                   : byPrintedMatrix(matrix_, column, row, raw)));
}

PointCloud ReferenceCamera::pointsOf(std::span<const std::uint16_t> raw) const {
  const auto width = static_cast<std::uint32_t>(camera_.width_px);
  const auto height = static_cast<std::uint32_t>(camera_.height_px);
  const std::size_t row_length = raw.size() / height;
  if (row_length < width || raw.size() % height != 0)
    throw std::invalid_argument("not an image of the camera");
  PointCloud cloud;
  cloud.points_m.reserve(raw.size());
  for (std::vector<std::uint32_t>* const numbers : {&cloud.column, &cloud.row, &cloud.raw}) {
    numbers->reserve(raw.size());
  }
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      const std::uint32_t d = raw[row * row_length + column];
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
