// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/error.h"
#include "tools/hapticbench/stability/stability_study.h"

namespace hapticd::tools {

/// The region as tab-separated values, one header line.
std::string regionTsv(const std::vector<RegionPoint>& points);

/// The region as an SVG, one panel per wall, made by gnuplot.
/// Errors: gnuplot is not installed or fails, or the file cannot be written.
config::Result<void> plotRegion(const std::vector<RegionPoint>& points, const std::string& title,
                                const std::filesystem::path& svg_file);

}  // namespace hapticd::tools
