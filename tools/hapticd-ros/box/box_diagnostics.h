// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/lib/client/varlink_client.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

/// The bridge's own counters, since its start.
struct BridgeCounters {
  std::uint64_t messages = 0;         ///< written
  std::uint64_t messages_failed = 0;  ///< that could not be written
  std::uint64_t ticks_lost = 0;       ///< that hapticd could not hand over in time
  std::uint64_t ticks_late = 0;       ///< not published, because they were too old when they came
};

/// One entry for the box, its force loop, camera and handle, and the bridge.
/// status: of io.hapticd.Status; null: hapticd does not answer, for the reason `problem`.
/// name_space: begins the names.
std::vector<Diagnostic> diagnosticsOf(const Json& status, const std::string& problem,
                                      const BridgeCounters& counters, const std::string& name_space);

}  // namespace hapticd::tools::ros
