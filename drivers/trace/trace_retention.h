// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/trace/trace_folder.h"

namespace hapticd::drivers {

/// Which traces a limit on a folder's size may delete.
struct RetentionPlan {
  std::uint64_t bytes = 0;            ///< of all traces
  std::uint64_t protected_bytes = 0;  ///< of those that are never deleted
  std::size_t kept = 0;               ///< number of traces marked to be kept
  std::size_t dumps = 0;              ///< number of unmarked traces written by the flight recorder
  std::vector<TraceEntry> deletable;  ///< all others, oldest first
};

/// Plans which traces may be deleted. Protected are unfinished traces, those marked to be kept, those written
/// by the flight recorder, the newest finished one of the others, and `just_finished`, which is not the
/// newest one if the clock was set back. The damaged original of a recovered trace is like an ordinary trace
/// of the same age. `traces`: oldest first, as returned by listTraces().
RetentionPlan planRetention(std::span<const TraceEntry> traces, std::string_view just_finished);

}  // namespace hapticd::drivers
