// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::config {

/// A violated rule between parameters whose individual values are all in range.
struct Conflict {
  /// Names of the parameters that the rule involves, the most likely cause first.
  std::vector<std::string_view> parameters;
  Error error;  ///< where: the first parameter
};

/// Returns every violated rule, or none.
std::vector<Conflict> conflictsIn(const Settings& settings);

/// Adds a conflict unless the window that follows the HIP covers, for each law that may be used, everything
/// that the law needs until the next frame.
void findWindowConflict(const Settings& settings, std::vector<Conflict>& conflicts);

/// Adds a conflict unless the raw values of a camera that delivers depth are few enough for a scene: those
/// within the reach of each law on points that may be used, or those of the whole frame where it is modelled.
void findDepthUnitConflict(const Settings& settings, std::vector<Conflict>& conflicts);

/// Adds a conflict unless the grid over the whole frame fits into the memory reserved for it.
void findFrameGridConflict(const Settings& settings, std::vector<Conflict>& conflicts);

}  // namespace hapticd::config
