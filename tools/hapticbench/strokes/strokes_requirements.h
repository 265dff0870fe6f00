// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/strokes/strokes_study.h"

namespace hapticd::tools {

/// A bound that every row it is for must keep, and how one law keeps it.
struct StrokesRequirement {
  std::string law;
  std::string text;
  int rows = 0;       ///< that it is for
  int violated = 0;   ///< of them
  std::string worst;  ///< the row that is farthest beyond the bound or nearest to it, with its figure
};

/// The bounds for each law with a proxy in `rows`; those without a row have none.
std::vector<StrokesRequirement> strokesRequirements(const std::vector<StrokesRow>& rows);

}  // namespace hapticd::tools
