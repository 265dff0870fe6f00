// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/hapticbench/engine/report.h"

namespace hapticd::tools {

/// The script with which gnuplot draws tables (PNG, SVG or PDF by the ending of `image`): for each table a
/// row of panels, one for each column of numbers, in which a point stands for each row of the table. The
/// words that name a row stand beside the first panel. A panel has a logarithmic axis where all its numbers
/// are positive and span more than a factor of 50. Tables without numbers are left out.
std::string drawingOf(const std::vector<NamedTable>& tables, const std::filesystem::path& image);

}  // namespace hapticd::tools
