// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "rt/loop_state.h"

namespace hapticd::tools {

/// Periods of the force loop in which no tick began, because the one before ended too late. Ticks are
/// numbered without them, so that only the planned times show them.
struct EmptyPeriods {
  std::int64_t period_ns = 0;    ///< 0: not known, from fewer than two ticks
  std::uint64_t periods = 0;     ///< from the first tick to the last one, both counted in
  std::uint64_t empty = 0;       ///< of them without a tick; those of ticks that the trace lacks do not count
  std::uint64_t stretches = 0;   ///< runs of empty periods
  std::uint64_t longest = 0;     ///< periods of the longest run
  std::uint64_t after_tick = 0;  ///< number of the tick before it
  std::int64_t after_ns = 0;     ///< planned time of that tick
};

/// Finds them.  Thread: one.
class EmptyPeriodCount {
 public:
  /// In the order of time.
  void add(const rt::Tick& tick);
  /// period_ns: of the loop; nothing: the shortest time between two ticks.
  EmptyPeriods finish(std::optional<std::int64_t> period_ns) const;

 private:
  /// Steps from one tick to the next that are alike: there are few kinds of them.
  struct Steps {
    std::uint64_t count = 0;
    std::uint64_t after_tick = 0;  ///< the first of them
    std::int64_t after_ns = 0;
  };
  /// By the planned time that they take, nanoseconds, and by how much the number grows.
  std::map<std::pair<std::int64_t, std::uint64_t>, Steps> steps_;
  std::optional<std::pair<std::int64_t, std::uint64_t>> last_;
};

}  // namespace hapticd::tools
