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

/// All tables in Markdown: the error to expect by distance, what the sensor allows, what each law costs, the
/// libraries beside the laws, and the requirements with what was measured.
std::string paretoMarkdown(const ParetoResult& result);

/// One table in Markdown: the error of the law `surface` in JND by distance and kind of surface, from the
/// smallest to the largest over the cameras.
std::string surfaceErrorMarkdown(const ParetoResult& result);

/// CPU time per second of use (x) against RMS error in JND (y), both logarithmic, every point with its name:
/// the script by which gnuplot makes an SVG, or a PNG where the name of the file ends so.
std::string plotScript(const ParetoResult& result, const std::filesystem::path& image);
/// Errors: gnuplot is not installed or fails, or the file cannot be written.
config::Result<void> plotPareto(const ParetoResult& result, const std::filesystem::path& image);

}  // namespace hapticd::tools
