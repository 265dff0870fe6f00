// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/window_mean.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace hapticd::drivers {
namespace {

/// Adds a row to sums that no other pointer refers to, so that the compiler uses vectors.
void add(const float* row, std::size_t count, float* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += row[i];
}

}  // namespace

void smoothOverWindow(int window, int width, int height, std::span<const float> cells,
                      std::span<float> image) {
  const auto columns = static_cast<std::size_t>(width);
  const auto rows = static_cast<std::size_t>(height);
  const auto side = static_cast<std::size_t>(window);
  const std::size_t reach = side / 2;
  std::vector<float> row_sums(cells.size());
  std::vector<float> padded(columns + side - 1);
  for (std::size_t row = 0; row < rows; ++row) {
    const float* const cell = &cells[row * columns];
    for (std::size_t k = 0; k < reach; ++k) padded[k] = cell[columns - reach + k];
    std::copy_n(cell, columns, &padded[reach]);
    for (std::size_t k = 0; reach + k + 1 < side; ++k) padded[reach + columns + k] = cell[k];
    for (std::size_t k = 0; k < side; ++k) add(&padded[k], columns, &row_sums[row * columns]);
  }
  // A sum of window^2 cells has `window` times their standard deviation.
  const float unit_variance = 1.0F / static_cast<float>(window);
  std::vector<float> total(columns);
  for (std::size_t row = 0; row < rows; ++row) {
    std::ranges::fill(total, 0.0F);
    for (std::size_t k = 0; k < side; ++k)
      add(&row_sums[(row + rows + k - reach) % rows * columns], columns, total.data());
    std::ranges::transform(total, &image[row * columns], [=](float sum) { return sum * unit_variance; });
  }
}

}  // namespace hapticd::drivers
