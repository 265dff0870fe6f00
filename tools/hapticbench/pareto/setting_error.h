// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/pareto/law_setting.h"

namespace hapticd::tools {

using ErrorsOfSettings = std::map<LawSetting, ForceErrors>;

/// Errors of the force against the true surface, 5 to 20 mm behind it, on the named scenes of
/// accuracyScenes() together, with `noise`. `pushes`: per scene.
ErrorsOfSettings errorsOf(const std::vector<LawSetting>& settings, const std::vector<std::string>& scenes,
                          double distance_m, int pushes, SceneNoise noise);

}  // namespace hapticd::tools
