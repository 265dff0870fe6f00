// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string>

#include "rt/loop/loop_state.h"
#include "tools/haptic-replay/trace_replay.h"

namespace hapticd::tools {

/// The forces of a trace as CSV, one line per tick that was computed again.
class ForceTable {
 public:
  void add(const rt::Tick& recorded, const rt::Tick& computed);
  std::string text() const;

 private:
  fmt::memory_buffer text_;
};

/// The number of ticks that were not computed again.
std::uint64_t leftOut(const TraceComparison& comparison);

/// What a comparison shows, for people, in lines.
std::string comparisonText(const TraceComparison& comparison);

}  // namespace hapticd::tools
