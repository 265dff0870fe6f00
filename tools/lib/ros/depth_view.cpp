// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/depth_view.h"

#include <cmath>
#include <cstring>
#include <limits>

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kRawValues = std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1;

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
    depth_m_[raw] = static_cast<float>(depth_m);
    depth_mm_[raw] = static_cast<std::uint16_t>(std::lround(1000 * depth_m));
  }
}

std::uint16_t DepthView::rawAt(std::size_t row, std::size_t column) const {
  std::uint16_t raw = 0;
  std::memcpy(&raw, image_.data() + row * header_->stride_bytes + column * sizeof raw, sizeof raw);
  return raw;
}

void DepthView::points(std::vector<float>& xyz_m) const {
  // room for all, and cut afterwards: much faster than growing with each point
  xyz_m.resize(std::size_t{3} * header_->width_px * header_->height_px);
  float* next = xyz_m.data();
  for (std::size_t row = 0; row < header_->height_px; ++row) {
    const auto row_slope = static_cast<float>((static_cast<double>(row) - header_->cy_px) / header_->fy_px);
    for (std::size_t column = 0; column < header_->width_px; ++column) {
      const float depth_m = depth_m_[rawAt(row, column)];
      if (depth_m == 0) continue;
      next[0] = column_slope_[column] * depth_m;
      next[1] = row_slope * depth_m;
      next[2] = depth_m;
      next += 3;
    }
  }
  xyz_m.resize(static_cast<std::size_t>(next - xyz_m.data()));
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

}  // namespace hapticd::tools::ros
