// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/sweep/sweep_run.h"

namespace hapticd::tools {

/// The table for people, in the order of the laws, and for programs, in that of the grid.
std::string sweepText(const SweepSettings& settings, const std::vector<SweepResult>& results);
std::string sweepJson(const SweepSettings& settings, const std::vector<SweepResult>& results);

}  // namespace hapticd::tools
