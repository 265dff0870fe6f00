// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticbench/sweep/sweep_file.h"

namespace hapticd::tools {

/// The table for people; with the recommendation where the part is whole.
std::string sweepTable(const SweepPart& part);

}  // namespace hapticd::tools
