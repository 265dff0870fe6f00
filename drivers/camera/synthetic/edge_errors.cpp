// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/edge_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "drivers/camera/synthetic/noise_pattern.h"

namespace hapticd::drivers {

void removeShadow(std::span<float> disparities, ShadowSide side, double pixels_per_raw) {
  if (side == ShadowSide::none) return;
  // Position of a pixel in the projector's image, counted away from the projector: column - pixels_per_raw *
  // disparity. To be lit, it must lie beyond all pixels before it.
  const auto scale = static_cast<float>(pixels_per_raw);
  const std::size_t count = disparities.size();
  float farthest = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    float& disparity = disparities[side == ShadowSide::right ? i : count - 1 - i];
    if (disparity < 0) continue;
    const float in_projector = static_cast<float>(i) - scale * disparity;
    if (in_projector < farthest) {
      disparity = kNothingSeen;
    } else {
      farthest = in_projector;
    }
  }
}

namespace {

constexpr std::uint32_t kEdgePurpose = 0x23;

/// Whether a surface at `far_m` is seen behind the edge of one at `near_m`.
bool isBehind(float far_m, float near_m) noexcept {
  return near_m > 0 && far_m - near_m > EdgeErrors::kEdgeJump * near_m;
}

}  // namespace

EdgeErrors::EdgeErrors(const rt::DepthModelParameters& camera, double baseline_m, std::uint32_t seed)
    : camera_(camera),
      focal_baseline_px_m_(camera.fx_px * baseline_m),
      salt_(static_cast<std::uint32_t>(bitsFor(seed, kEdgePurpose, 0))) {}

std::uint32_t EdgeErrors::bitsOf(std::size_t pixel) const noexcept {
  return scramble32(static_cast<std::uint32_t>(pixel) * kCellFactor + salt_);
}

void EdgeErrors::applyTo(std::span<float> depths_m) const {
  if (camera_.principle == rt::DepthPrinciple::structured_light) return;
  const std::vector<float> exact_m(depths_m.begin(), depths_m.end());
  if (camera_.principle == rt::DepthPrinciple::time_of_flight) return mix(exact_m, depths_m);
  removeUnmatched(depths_m);
  widen(exact_m, depths_m);
}

void EdgeErrors::removeUnmatched(std::span<float> depths_m) const {
  const auto width = static_cast<std::size_t>(camera_.width_px);
  for (std::size_t first = 0; first < depths_m.size(); first += width)
    removeUnmatchedIn(depths_m.subspan(first, width), focal_baseline_px_m_);
}

/// Continues nearer surfaces over their edges, along rows and columns.
void EdgeErrors::widen(std::span<const float> exact_m, std::span<float> depths_m) const {
  const int reach = static_cast<int>(std::lround(camera_.noise.correlation_px)) / 2;
  const auto widths = static_cast<std::uint32_t>(reach + 1);
  const int width = camera_.width_px;
  const int height = camera_.height_px;
  const auto at = [width](int column, int row) { return static_cast<std::size_t>(row * width + column); };
  const auto over = [&](int column, int row, int right, int down) {
    const float near_m = exact_m[at(column, row)];
    if (!(depths_m[at(column, row)] > 0)) return;  // out of the other imager's view
    for (int k = 1; k <= reach; ++k) {
      column += right;
      row += down;
      if (column < 0 || column >= width || row < 0 || row >= height) return;
      const std::size_t pixel = at(column, row);
      if (!isBehind(exact_m[pixel], near_m)) return;
      if (k > static_cast<int>(bitsOf(pixel) % widths)) continue;
      const bool has_nearer = isBehind(near_m, depths_m[pixel]);
      if (!has_nearer) depths_m[pixel] = near_m;
    }
  };
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const float here_m = exact_m[at(column, row)];
      if (column > 0) {
        const float left_m = exact_m[at(column - 1, row)];
        if (isBehind(left_m, here_m)) over(column, row, -1, 0);
        if (isBehind(here_m, left_m)) over(column - 1, row, 1, 0);
      }
      if (row > 0) {
        const float above_m = exact_m[at(column, row - 1)];
        if (isBehind(above_m, here_m)) over(column, row, 0, -1);
        if (isBehind(here_m, above_m)) over(column, row - 1, 0, 1);
      }
    }
  }
}

void EdgeErrors::mix(std::span<const float> exact_m, std::span<float> depths_m) const {
  const auto width = static_cast<std::size_t>(camera_.width_px);
  for (std::size_t pixel = 0; pixel < exact_m.size(); ++pixel) {
    const float here_m = exact_m[pixel];
    if (!(here_m > 0)) continue;
    const std::size_t column = pixel % width;
    const std::array beside{column > 0 ? pixel - 1 : pixel, column + 1 < width ? pixel + 1 : pixel,
                            pixel >= width ? pixel - width : pixel,
                            pixel + width < exact_m.size() ? pixel + width : pixel};
    const auto other = std::ranges::find_if(beside, [&](std::size_t neighbour) {
      return isBehind(exact_m[neighbour], here_m) || isBehind(here_m, exact_m[neighbour]);
    });
    if (other == beside.end()) continue;
    // the edge is somewhere between two middles of pixels, in the half that belongs to one or to the other
    const float share = static_cast<float>(bitsOf(pixel) >> 8) * 0x1p-24F;
    if (share < 0.5F) depths_m[pixel] += share * (exact_m[*other] - here_m);
  }
}

void removeUnmatchedIn(std::span<float> row_m, double focal_baseline_px_m) {
  float nearest_m = 0;
  for (const float depth_m : row_m) {
    if (depth_m > 0 && (nearest_m == 0 || depth_m < nearest_m)) nearest_m = depth_m;
  }
  if (nearest_m == 0) return;
  // Disparities from the nearest surface on, in 1/m and growing with the distance, as of a camera with the
  // second imager in place of the projector.
  std::vector<float> behind_nearest(row_m.size(), kNothingSeen);
  for (std::size_t column = 0; column < row_m.size(); ++column) {
    if (!(row_m[column] > 0)) continue;
    const float inverse = 1 / row_m[column];
    const float column_in_other =
        static_cast<float>(column) - static_cast<float>(focal_baseline_px_m) * inverse;
    if (column_in_other >= -0.5F) behind_nearest[column] = std::max(1 / nearest_m - inverse, 0.0F);
  }
  removeShadow(behind_nearest, ShadowSide::left, focal_baseline_px_m);
  for (std::size_t column = 0; column < row_m.size(); ++column) {
    if (behind_nearest[column] < 0) row_m[column] = kNothingSeen;
  }
}

}  // namespace hapticd::drivers
