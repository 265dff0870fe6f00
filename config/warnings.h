// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::config {

/// Returns settings that are allowed but probably unintended; they are shown, never refused.
std::vector<Error> warningsOf(const Settings& settings);

}  // namespace hapticd::config
