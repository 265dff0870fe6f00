// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/settings/driver_rows.h"
#include "config/settings/settings.h"

namespace hapticd::config {

/// Returns every violated rule, or none.
std::vector<Conflict> conflictsIn(const Settings& settings);

}  // namespace hapticd::config
