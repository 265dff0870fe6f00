#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/pareto/law_setting.h"

namespace hapticd::tools {

/// What measureAccuracy() calls the error against the true surface, with sensor noise, of a setting that it
/// does not know: one that fuses frames. `scenes`: of accuracyScenes(). `pushes`: per scene.
ForceErrors followedError(const LawSetting& setting, const std::vector<std::string>& scenes,
                          double distance_m, int pushes);

}  // namespace hapticd::tools
