// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/depth_noise/depth_picture.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string_view>

namespace hapticd::tools {
namespace {

constexpr std::string_view kFarToNear = ".:-=+*#%@";

/// Mean depth of a part of the image; 0 where most of it is holes.
double meanOf(const std::vector<double>& depth_m, int width_px, int left, int right, int top, int bottom) {
  double sum_m = 0;
  int count = 0;
  for (int row = top; row < bottom; ++row) {
    for (int column = left; column < right; ++column) {
      const double z_m = depth_m[static_cast<std::size_t>(row * width_px + column)];
      sum_m += z_m;
      if (z_m > 0) ++count;
    }
  }
  return 2 * count >= (right - left) * (bottom - top) && count > 0 ? sum_m / count : 0;
}

}  // namespace

std::string depthPicture(const std::vector<double>& depth_m, int width_px, int height_px, int columns) {
  columns = std::clamp(columns, 1, width_px);
  const int lines = std::max(1, height_px * columns / (2 * width_px));
  std::vector<double> parts;
  double nearest_m = std::numeric_limits<double>::infinity();
  double farthest_m = 0;
  for (int line = 0; line < lines; ++line) {
    for (int column = 0; column < columns; ++column) {
      parts.push_back(meanOf(depth_m, width_px, column * width_px / columns,
                             (column + 1) * width_px / columns, line * height_px / lines,
                             (line + 1) * height_px / lines));
      if (parts.back() > 0) nearest_m = std::min(nearest_m, parts.back());
      farthest_m = std::max(farthest_m, parts.back());
    }
  }
  if (!(farthest_m > 0)) return "";
  const double span_m = std::max(farthest_m - nearest_m, 1e-9);
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double nearness = (farthest_m - parts[i]) / span_m;
    const auto letter = static_cast<std::size_t>(nearness * (kFarToNear.size() - 1) + 0.5);
    text += parts[i] > 0 ? kFarToNear[std::min(letter, kFarToNear.size() - 1)] : ' ';
    if ((i + 1) % static_cast<std::size_t>(columns) == 0) text += '\n';
  }
  return text;
}

}  // namespace hapticd::tools
