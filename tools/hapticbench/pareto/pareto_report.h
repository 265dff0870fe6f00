// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/error.h"
#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// All figures and requirements, for people and for programs. `cpu`: that it ran on, -1: not pinned.
std::string paretoText(const ParetoResult& result, int cpu);
std::string paretoJson(const ParetoResult& result, int cpu);

/// In Markdown: the error to expect at which distance, what the sensor allows, what each law costs, a link to
/// the plot, and the requirements. `plot`: its path as the document is to name it; empty: no link.
std::string paretoMarkdown(const ParetoResult& result, const std::string& plot);

/// CPU time per second of use (x) against RMS error in JND (y), both logarithmic, every point with its name:
/// the script by which gnuplot makes an SVG, or a PNG where the name of the file ends so.
std::string plotScript(const ParetoResult& result, const std::filesystem::path& image);
/// Errors: gnuplot is not installed or fails, or the file cannot be written.
config::Result<void> plotPareto(const ParetoResult& result, const std::filesystem::path& image);

}  // namespace hapticd::tools
