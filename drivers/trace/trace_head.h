// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace hapticd::drivers {

/// Whether raw depth is recorded in a trace, finished or not: whether it was begun with a channel for that.
/// Reads only what is in front of the first chunk. False for what is no trace.
/// Thread: any.  RT: not safe.
bool hasDepthChannel(const std::filesystem::path& trace);

}  // namespace hapticd::drivers
