// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/strokes/strokes_study.h"

namespace hapticd::tools {

/// For people: one line per row.
std::string strokesTable(const std::vector<StrokesRow>& rows);

/// The same for programs, as JSON.
std::string strokesJson(const std::vector<StrokesRow>& rows);

}  // namespace hapticd::tools
