// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/foxglove/depth_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace hapticd::drivers {
namespace {

/// Pixels from first to last, not including the last.
struct Range {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

/// Returns the depth along the optical axis, or 0 if the raw value stands for no point.
double depthOf(const rt::DepthFrameHeader& header, std::uint32_t raw) {
  const auto& [scale, offset] = header.depth_law_coefficients;
  const double value = scale * raw + offset;
  const double depth_m = header.depth_law == rt::DepthLawKind::reciprocal ? 1 / value : value;
  const bool measured =
      raw != header.raw_no_measurement && depth_m > 0 && depth_m <= DepthPoints::kFarthest_m;
  return measured ? depth_m : 0;
}

std::uint16_t rawAt(std::span<const std::byte> row, std::uint32_t column) {
  std::uint16_t raw = 0;
  std::memcpy(&raw, row.data() + column * sizeof raw, sizeof raw);
  return raw;
}

/// Returns the pixels along one axis of the image that can show points between `low_m` and `high_m` on that
/// axis of the camera, at depths from `near_m` on.
Range pixelsBetween(double low_m, double high_m, double near_m, double far_m, double centre_px, double f_px,
                    std::uint32_t size_px) {
  if (!(near_m > 0)) return {0, size_px};
  const double low_px = centre_px + f_px * std::min(low_m / near_m, low_m / far_m);
  const double high_px = centre_px + f_px * std::max(high_m / near_m, high_m / far_m);
  const double most_px = size_px;
  const auto first = static_cast<std::uint32_t>(std::clamp(std::floor(low_px), 0.0, most_px));
  const auto last = static_cast<std::uint32_t>(std::clamp(std::ceil(high_px) + 1, 0.0, most_px));
  return {first, last};
}

/// Returns the centre of a ball in the camera frame.
rt::Vec3 inCamera(const rt::DepthFrameHeader& header, const rt::Vec3& point_m_in_world) {
  const auto& r = header.rotation_world_camera;
  const auto& [x_m, y_m, z_m] = header.position_m_in_world;
  const rt::Vec3 d = point_m_in_world - rt::Vec3{x_m, y_m, z_m};
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
          r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

}  // namespace

void DepthPoints::updateTable(const rt::DepthFrameHeader& header) {
  const bool same = !depth_m_.empty() && table_of_.depth_law == header.depth_law &&
                    table_of_.depth_law_coefficients == header.depth_law_coefficients &&
                    table_of_.raw_no_measurement == header.raw_no_measurement;
  if (same) return;
  table_of_ = header;
  depth_m_.resize(std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1);
  for (std::uint32_t raw = 0; raw < depth_m_.size(); ++raw) depth_m_[raw] = depthOf(header, raw);
}

std::span<const float> DepthPoints::decimated(const rt::DepthFrameHeader& header,
                                              std::span<const std::byte> image, std::uint32_t step) {
  updateTable(header);
  points_.clear();
  for (std::uint32_t row = 0; row < header.height_px; row += step) {
    const auto pixels = image.subspan(std::size_t{row} * header.stride_bytes, header.stride_bytes);
    const double y_of_z = (row - header.cy_px) / header.fy_px;
    for (std::uint32_t column = 0; column < header.width_px; column += step) {
      const double depth_m = depth_m_[rawAt(pixels, column)];
      if (depth_m == 0) continue;
      const double x_of_z = (column - header.cx_px) / header.fx_px;
      points_.push_back(static_cast<float>(depth_m * x_of_z));
      points_.push_back(static_cast<float>(-depth_m * y_of_z));
      points_.push_back(static_cast<float>(-depth_m));
    }
  }
  return points_;
}

std::span<const float> DepthPoints::inBall(const rt::DepthFrameHeader& header,
                                           std::span<const std::byte> image, const ModelledBall& ball) {
  updateTable(header);
  points_.clear();
  const rt::Vec3 centre = inCamera(header, ball.centre_m_in_world);
  const double r = ball.radius_m;
  const double near_m = -centre.z - r, far_m = -centre.z + r;
  if (!rt::isFinite(centre) || !(r > 0) || !(far_m > 0)) return points_;
  const Range columns =
      pixelsBetween(centre.x - r, centre.x + r, near_m, far_m, header.cx_px, header.fx_px, header.width_px);
  const Range rows = pixelsBetween(-centre.y - r, -centre.y + r, near_m, far_m, header.cy_px, header.fy_px,
                                   header.height_px);
  for (std::uint32_t row = rows.first; row < rows.last; ++row) {
    const auto pixels = image.subspan(std::size_t{row} * header.stride_bytes, header.stride_bytes);
    const double y_of_z = (row - header.cy_px) / header.fy_px;
    for (std::uint32_t column = columns.first; column < columns.last; ++column) {
      const double depth_m = depth_m_[rawAt(pixels, column)];
      if (depth_m == 0 || depth_m < near_m || depth_m > far_m) continue;
      const double x_of_z = (column - header.cx_px) / header.fx_px;
      const rt::Vec3 point{depth_m * x_of_z, -depth_m * y_of_z, -depth_m};
      const rt::Vec3 apart = point - centre;
      if (rt::dot(apart, apart) > r * r) continue;
      for (const double component : {point.x, point.y, point.z}) {
        points_.push_back(static_cast<float>(component));
      }
    }
  }
  return points_;
}

}  // namespace hapticd::drivers
