// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/requirement.h"
#include "tools/hapticbench/strokes/strokes_study.h"

namespace hapticd::tools {

/// The requirements on each law with a proxy in `rows`; those that apply to no row are left out.
std::vector<Requirement> requirementsOf(const std::vector<StrokesRow>& rows);

/// The rows and the requirements, for people and for programs.
std::string strokesText(const std::vector<StrokesRow>& rows);
std::string strokesJson(const std::vector<StrokesRow>& rows);

}  // namespace hapticd::tools
