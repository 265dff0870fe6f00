// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace hapticd::tools {

/// What of a trace is wanted.
struct TraceSelection {
  double from_s = 0;  ///< since the first tick, or the first message of a trace without ticks
  double to_s = std::numeric_limits<double>::infinity();
  /// At most that many ticks, 0: all. The ticks then fall into stretches of the same length, each of which
  /// gives the tick of least and the tick of largest |command force|: no peak is lost. At least 2.
  std::size_t most_ticks = 0;
};

/// Gets the share of the work that is done, 0..1, now and then; may be empty.
using Progress = std::function<void(double)>;

}  // namespace hapticd::tools
