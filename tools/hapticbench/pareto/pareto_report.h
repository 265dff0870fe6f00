#pragma once

#include <string>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// For people. `cpu`: that it ran on, -1: not pinned.
std::string paretoTable(const ParetoResult& result, int cpu);

/// For programs.
std::string paretoJson(const ParetoResult& result, int cpu);

/// For the README: a link to the plot and the current figures, in Markdown. `plot`: its path as the README is
/// to name it; empty: no link.
std::string paretoMarkdown(const ParetoResult& result, const std::string& plot);

}  // namespace hapticd::tools
