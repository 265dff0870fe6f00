// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/trace/trace_folder.h"

namespace hapticd::drivers {

/// What a limit of a folder's size may delete, and what not.
struct RetentionPlan {
  std::uint64_t bytes = 0;            ///< of all traces
  std::uint64_t protected_bytes = 0;  ///< of those that no limit deletes
  std::size_t kept = 0;               ///< traces that are marked to be kept
  std::size_t dumps = 0;              ///< traces that the flight recorder has written, not marked
  std::vector<TraceEntry> deletable;  ///< all others, the oldest first
};

/// Protected are: traces that are not finished, those marked to be kept, what the flight recorder has
/// written, the newest finished one of the others, and `just_finished`, which is not the newest one where the
/// clock has been set back. `traces`: the oldest first, as listTraces() has them.
RetentionPlan planRetention(std::span<const TraceEntry> traces, std::string_view just_finished);

}  // namespace hapticd::drivers
