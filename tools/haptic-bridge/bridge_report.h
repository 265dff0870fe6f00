// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/haptic-bridge/bridge.h"

namespace hapticd::tools {

/// The summary as a table for people.
std::string bridgeTable(const BridgeSummary& summary);

}  // namespace hapticd::tools
