// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/focus/focus_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

int FocusImage::strideFor(double radius_px, double area_px2) noexcept {
  constexpr double kSamples = 550;
  constexpr int kMaxReach = FocusSamples::kMaxPerSide / 2;
  const double area = std::min(area_px2, std::numbers::pi * radius_px * radius_px);
  return static_cast<int>(
      std::max({1.0, std::ceil(std::sqrt(area / kSamples)), std::ceil(radius_px / kMaxReach)}));
}

std::size_t FocusImage::collect(double radius_px, int stride, FocusSamples& samples) const noexcept {
  constexpr int kSide = FocusSamples::kCellsPerSide;
  const int column_0 = static_cast<int>(std::lround(column_px));
  const int row_0 = static_cast<int>(std::lround(row_px));
  const int reach = static_cast<int>(radius_px) / stride;
  const int per_side = 2 * reach + 1;
  const double most = radius_px * radius_px;
  std::size_t count = 0;
  std::size_t seen = 0;
  for (int cell = 0; cell < FocusSamples::kCells; ++cell) {
    samples.cell_begin[cell] = count;
    const auto begin = [&](int i) { return i * per_side / kSide - reach; };
    for (int j = begin(cell / kSide); j < begin(cell / kSide + 1); ++j) {
      const int row = row_0 + j * stride;
      if (row < pixels.row_first || row > pixels.row_last) continue;
      const double dy = row - row_px;
      for (int i = begin(cell % kSide); i < begin(cell % kSide + 1); ++i) {
        const int column = column_0 + i * stride;
        if (column < pixels.column_first || column > pixels.column_last) continue;
        const double dx = column - column_px;
        if (dx * dx + dy * dy > most) continue;
        const std::uint16_t raw = image[row * stride_px + column];
        if (raw >= kNoRawDisparity) continue;
        samples.column_px[count] = static_cast<float>(dx);
        samples.row_px[count] = static_cast<float>(dy);
        samples.disparity_raw[count] =
            static_cast<float>(raw) - column_shift_raw[column / BlockLattice::kBlock_px];
        samples.weight[count] = 1;
        ++count;
        ++seen;
      }
    }
    while (count % FocusSamples::kAlignment != 0) {
      samples.column_px[count] = samples.row_px[count] = samples.disparity_raw[count] = 0;
      samples.weight[count++] = 0;
    }
  }
  samples.cell_begin[FocusSamples::kCells] = count;
  return seen;
}

}  // namespace hapticd::rt
