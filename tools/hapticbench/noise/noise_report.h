// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/noise/noise_statistics.h"

namespace hapticd::tools {

/// For people: one line per window size, then the autocovariances of the window of 64 pixels (or the
/// largest).
std::string noiseTable(const std::string& source, const std::vector<NoiseStatistics>& statistics);

/// For programs; what could not be measured is null.
std::string noiseJson(const std::string& source, int frames, const std::vector<NoiseStatistics>& statistics);

}  // namespace hapticd::tools
