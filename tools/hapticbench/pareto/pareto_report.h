// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// For people. `cpu`: that it ran on, -1: not pinned.
std::string paretoTable(const ParetoResult& result, int cpu);

/// For programs.
std::string paretoJson(const ParetoResult& result, int cpu);

}  // namespace hapticd::tools
