// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// For the README, in Markdown: what error to expect at which distance, what the sensor allows, what each law
/// costs, a link to the plot, and what must hold. `plot`: its path as the README is to name it; empty: no
/// link.
std::string paretoMarkdown(const ParetoResult& result, const std::string& plot);

}  // namespace hapticd::tools
