// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/force_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace hapticd::tools {
namespace {

constexpr std::array<std::string_view, 9> kBlocks{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array<std::string_view, 4> kSigns{" ", ".", "+", "#"};
constexpr std::size_t kScaleColumns = 10;  // "  10.0 N |"

/// 1, 2 or 5 times a power of ten, not below `value`.
double roundedUp(double value) {
  double decade = 0.1;
  for (;; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (value <= step * decade) return step * decade;
    }
  }
}

/// Returns how many of the `steps` of a column are filled in a row.
std::size_t fill(double share, std::size_t row_from_below, std::size_t rows, std::size_t steps) {
  const double in_row = share * static_cast<double>(rows) - static_cast<double>(row_from_below);
  return static_cast<std::size_t>(std::lround(std::clamp(in_row, 0.0, 1.0) * static_cast<double>(steps)));
}

}  // namespace

void ForceHistory::add(double max_force_n) {
  forces_n_.push_back(max_force_n);
  if (forces_n_.size() > kWindows) forces_n_.pop_front();
}

std::vector<std::string> ForceHistory::lines(std::size_t rows, std::size_t columns, bool utf8) const {
  if (columns <= kScaleColumns || rows == 0) return {};
  const std::size_t shown = std::min(columns - kScaleColumns, forces_n_.size());
  const std::vector<double> newest(forces_n_.end() - static_cast<std::ptrdiff_t>(shown), forces_n_.end());
  double largest_n = 0;
  for (const double force_n : newest) largest_n = std::fmax(largest_n, force_n);
  const double scale_n = roundedUp(largest_n);
  const std::size_t steps = (utf8 ? kBlocks.size() : kSigns.size()) - 1;

  std::vector<std::string> drawn;
  for (std::size_t row = rows; row-- > 0;) {
    const bool top = row + 1 == rows;
    std::string line = top ? fmt::format("{:>6.1f} N |", scale_n) : row == 0 ? "     0 N |" : "         |";
    for (const double force_n : newest) {
      const std::size_t filled = std::isnan(force_n) ? 0 : fill(force_n / scale_n, row, rows, steps);
      line += utf8 ? kBlocks[filled] : kSigns[filled];
    }
    drawn.push_back(std::move(line));
  }
  return drawn;
}

}  // namespace hapticd::tools
