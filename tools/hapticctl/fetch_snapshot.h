// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>

#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// The daemon's newest depth frame. Without one the error has been printed, and the exit code is returned.
std::expected<Snapshot, int> fetchSnapshot(const CommandOptions& options);

}  // namespace hapticd::tools
