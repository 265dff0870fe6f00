// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/speed.h"

namespace hapticd::tools {

/// The table for people.
std::string speedTable(const std::vector<SceneSpeed>& scenes, int cpu);

/// The same for programs, as JSON.
std::string speedJson(const std::vector<SceneSpeed>& scenes, int cpu);

}  // namespace hapticd::tools
