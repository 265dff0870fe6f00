// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

namespace hapticd::tools {

/// The largest forces of the newest windows, drawn with characters.
class ForceHistory {
 public:
  static constexpr std::size_t kWindows = 60;

  /// Adds the largest force of a window, in newtons; NaN for a window without ticks, which leaves a gap.
  void add(double max_force_n);

  /// `rows` lines of at most `columns`, the newest window at the right, the scale at the left: a round number
  /// of newtons that holds all of them. UTF-8 draws with block elements, eight steps a row; else with '#',
  /// '+' and '.'.
  std::vector<std::string> lines(std::size_t rows, std::size_t columns, bool utf8) const;

 private:
  std::deque<double> forces_n_;
};

}  // namespace hapticd::tools
