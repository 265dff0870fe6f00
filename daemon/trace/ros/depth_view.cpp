// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/ros/depth_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace hapticd::trace::ros {
namespace {

constexpr std::size_t kRawValues = std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1;

/// Pixels from first to last, not including the last.
struct Range {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

/// Returns the pixels along one axis of the image that can show points between `low_m` and `high_m` on that
/// axis of the optical frame, at depths from `near_m` on.
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

/// A place in the optical frame of the camera.
rt::Vec3 inOptical(const rt::DepthFrameHeader& header, const rt::Vec3& point_m_in_world) {
  const auto& r = header.rotation_world_camera;
  const auto& [x_m, y_m, z_m] = header.position_m_in_world;
  const rt::Vec3 d = point_m_in_world - rt::Vec3{x_m, y_m, z_m};
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, -(r[1] * d.x + r[4] * d.y + r[7] * d.z),
          -(r[2] * d.x + r[5] * d.y + r[8] * d.z)};
}

}  // namespace

void DepthView::set(const rt::DepthFrameHeader& header, std::span<const std::byte> image) {
  header_ = &header;
  image_ = image;
  const Law law{header.depth_law, header.depth_law_coefficients, header.raw_no_measurement};
  if (law != law_) {
    law_ = law;
    tabulate();
  }
  column_slope_.resize(header.width_px);
  for (std::size_t column = 0; column < column_slope_.size(); ++column)
    column_slope_[column] = static_cast<float>((static_cast<double>(column) - header.cx_px) / header.fx_px);
}

void DepthView::tabulate() {
  depth_m_.assign(kRawValues, 0);
  depth_mm_.assign(kRawValues, 0);
  const auto& [factor, offset] = law_->coefficients;
  for (std::size_t raw = 0; raw < kRawValues; ++raw) {
    if (raw == law_->raw_no_measurement) continue;
    const double value = factor * static_cast<double>(raw) + offset;
    const double depth_m = law_->kind == rt::DepthLawKind::linear ? value : 1 / value;
    if (!(value > 0 && depth_m <= kFarthest_m)) continue;
    depth_m_[raw] = depth_m;
    depth_mm_[raw] = static_cast<std::uint16_t>(std::lround(1000 * depth_m));
  }
}

std::uint16_t DepthView::rawAt(std::size_t row, std::size_t column) const {
  std::uint16_t raw = 0;
  std::memcpy(&raw, image_.data() + row * header_->stride_bytes + column * sizeof raw, sizeof raw);
  return raw;
}

void DepthView::points(std::vector<float>& xyz_m, std::uint32_t step) const {
  const auto countOf = [step](std::uint32_t pixels) { return (std::size_t{pixels} + step - 1) / step; };
  // room for all, and cut afterwards: much faster than growing with each point
  xyz_m.resize(3 * countOf(header_->width_px) * countOf(header_->height_px));
  float* next = xyz_m.data();
  for (std::size_t row = 0; row < header_->height_px; row += step) {
    const auto row_slope = static_cast<float>((static_cast<double>(row) - header_->cy_px) / header_->fy_px);
    for (std::size_t column = 0; column < header_->width_px; column += step) {
      const auto depth_m = static_cast<float>(depth_m_[rawAt(row, column)]);
      if (depth_m == 0) continue;
      next[0] = column_slope_[column] * depth_m;
      next[1] = row_slope * depth_m;
      next[2] = depth_m;
      next += 3;
    }
  }
  xyz_m.resize(static_cast<std::size_t>(next - xyz_m.data()));
}

void DepthView::pointsInBall(const ModelledBall& ball, std::vector<float>& xyz_m) const {
  xyz_m.clear();
  const rt::DepthFrameHeader& h = *header_;
  const rt::Vec3 centre = inOptical(h, ball.centre_m_in_world);
  const double r = ball.radius_m;
  const double near_m = centre.z - r, far_m = centre.z + r;
  if (!rt::isFinite(centre) || !(r > 0) || !(far_m > 0)) return;
  const Range columns =
      pixelsBetween(centre.x - r, centre.x + r, near_m, far_m, h.cx_px, h.fx_px, h.width_px);
  const Range rows = pixelsBetween(centre.y - r, centre.y + r, near_m, far_m, h.cy_px, h.fy_px, h.height_px);
  for (std::uint32_t row = rows.first; row < rows.last; ++row) {
    const double y_of_z = (row - h.cy_px) / h.fy_px;
    for (std::uint32_t column = columns.first; column < columns.last; ++column) {
      const double depth_m = depth_m_[rawAt(row, column)];
      if (depth_m == 0 || depth_m < near_m || depth_m > far_m) continue;
      const rt::Vec3 point{depth_m * (column - h.cx_px) / h.fx_px, depth_m * y_of_z, depth_m};
      const rt::Vec3 apart = point - centre;
      if (rt::dot(apart, apart) > r * r) continue;
      for (const double component : {point.x, point.y, point.z})
        xyz_m.push_back(static_cast<float>(component));
    }
  }
}

void DepthView::millimetres(DepthImage& picture) const {
  picture.width_px = header_->width_px;
  picture.height_px = header_->height_px;
  picture.depth_mm.resize(std::size_t{header_->width_px} * header_->height_px);
  auto next = picture.depth_mm.begin();
  for (std::size_t row = 0; row < header_->height_px; ++row) {
    for (std::size_t column = 0; column < header_->width_px; ++column)
      *next++ = depth_mm_[rawAt(row, column)];
  }
}

PinholeCamera DepthView::camera() const {
  return {header_->width_px, header_->height_px, header_->fx_px,
          header_->fy_px,    header_->cx_px,     header_->cy_px};
}

std::int64_t DepthView::time_ns() const {
  return header_->exposure_ns != 0 ? header_->exposure_ns : header_->arrival_ns;
}

}  // namespace hapticd::trace::ros
