// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// Rows of raw disparities to compare with those of the previous frame. Rows are whole multiples of
/// kRowAlignment_px long; where there is no measurement, values are above `last_raw`.
struct RowComparison {
  const std::uint16_t* now;
  std::ptrdiff_t now_stride_px;
  std::uint16_t* before;
  std::ptrdiff_t before_stride_px;
  int rows;
  int columns;
  std::uint16_t last_raw;
  std::int16_t max_difference_raw;  ///< a larger difference means that the pixel shows another surface
};

/// Stores, for each column, the sum of the differences of its pixels that show the same surface as before and
/// their number. `before` becomes `now`.  RT: safe after the first call.
void sumUpDifferences(const RowComparison& rows, std::int16_t* sum_raw, std::int16_t* count) noexcept;

}  // namespace hapticd::rt
