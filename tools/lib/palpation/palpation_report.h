// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/lib/palpation/palpation_map.h"

namespace hapticd::tools {

/// Returns a table of the cells and a line about the nodule, for people.
std::string palpationText(const PalpationMap& map);

/// Returns the same as JSON, in SI units: `cells` and `nodule` (null: none).
std::string palpationJson(const PalpationMap& map);

}  // namespace hapticd::tools
