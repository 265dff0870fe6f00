// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::config {

/// A violated rule between parameters whose single values are all in range.
struct Conflict {
  std::vector<std::string_view>
      parameters;  ///< names of those that the rule joins, the first one to blame first
  Error error;     ///< where: the first parameter
};

/// Every violated rule, or none.
std::vector<Conflict> conflictsIn(const Settings& settings);

/// The rule that the window which follows the HIP holds, for each law that may act, all that it looks at
/// until the next frame.
void findWindowConflict(const Settings& settings, std::vector<Conflict>& conflicts);

/// The rule that the grid over the whole frame stays within the memory that is set aside for it.
void findFrameGridConflict(const Settings& settings, std::vector<Conflict>& conflicts);

}  // namespace hapticd::config
