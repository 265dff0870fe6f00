// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::config {

/// What is allowed, but hardly meant: to be shown, never to be refused.
std::vector<Error> warningsOf(const Settings& settings);

}  // namespace hapticd::config
