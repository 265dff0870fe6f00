// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace hapticd::tools {

/// The part of a trace to use.
struct TraceSelection {
  double from_s = 0;  ///< since the first tick; in a trace without ticks since its first message
  double to_s = std::numeric_limits<double>::infinity();
  /// Use at most that many ticks, at least 2; 0: all. The ticks are divided into stretches of equal length,
  /// and of each the ticks with the least and the largest |command force| are used, so that no peak is lost.
  std::size_t most_ticks = 0;
};

/// Called now and then with the share of the work that is done, 0..1; may be empty.
using Progress = std::function<void(double)>;

}  // namespace hapticd::tools
