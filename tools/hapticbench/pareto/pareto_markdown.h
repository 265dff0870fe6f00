// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// All tables in Markdown: the error to expect by distance, what the sensor allows, what each law costs, the
/// libraries beside the laws, and the requirements with what was measured.
std::string paretoMarkdown(const ParetoResult& result);

/// One table in Markdown: the error of the law `surface` in JND by distance and kind of surface, from the
/// smallest to the largest over the cameras.
std::string surfaceErrorMarkdown(const ParetoResult& result);

}  // namespace hapticd::tools
