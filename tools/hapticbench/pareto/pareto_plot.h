// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/error.h"
#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// CPU time per second of use (x) against RMS error in JND (y), both logarithmic, every point with its name:
/// the script that gnuplot makes the SVG, or the PNG where the file's name ends so, with.
std::string plotScript(const ParetoResult& result, const std::filesystem::path& image);

/// Errors: gnuplot is not installed or fails, or the file cannot be written.
config::Result<void> plotPareto(const ParetoResult& result, const std::filesystem::path& image);

}  // namespace hapticd::tools
