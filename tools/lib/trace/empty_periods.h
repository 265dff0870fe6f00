// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "rt/loop_state.h"

namespace hapticd::tools {

/// Periods of the force loop in which no tick began, because the previous tick ended too late. They do not
/// count in the numbers of the ticks, so only the planned times show them.
struct EmptyPeriods {
  std::int64_t period_ns = 0;    ///< 0: unknown, because there are fewer than two ticks
  std::uint64_t periods = 0;     ///< from the first to the last tick, both included
  std::uint64_t empty = 0;       ///< periods without a tick, not counting ticks that the trace lacks
  std::uint64_t stretches = 0;   ///< number of runs of empty periods
  std::uint64_t longest = 0;     ///< length of the longest run, in periods
  std::uint64_t after_tick = 0;  ///< number of the tick before it
  std::int64_t after_ns = 0;     ///< planned time of that tick
};

/// Finds the empty periods of a trace.  Thread: one.
class EmptyPeriodCount {
 public:
  /// Adds a tick; ticks must be added in the order of time.
  void add(const rt::Tick& tick);
  /// Returns the result. period_ns: period of the loop; nothing: take the shortest time between two ticks.
  EmptyPeriods finish(std::optional<std::int64_t> period_ns) const;

 private:
  /// Equal steps from one tick to the next; there are few different ones.
  struct Steps {
    std::uint64_t count = 0;
    std::uint64_t after_tick = 0;  ///< the tick before the first such step
    std::int64_t after_ns = 0;
  };
  /// Keyed by the difference of the planned times, in nanoseconds, and of the numbers of the ticks.
  std::map<std::pair<std::int64_t, std::uint64_t>, Steps> steps_;
  std::optional<std::pair<std::int64_t, std::uint64_t>> last_;
};

}  // namespace hapticd::tools
