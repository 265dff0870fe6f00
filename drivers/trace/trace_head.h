// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace hapticd::drivers {

/// Returns whether a trace, finished or not, contains raw depth, i.e. was begun with a channel for it. Reads
/// only what precedes the first chunk. Returns false for a file that is not a trace.
/// Thread: any.  RT: not safe.
bool hasDepthChannel(const std::filesystem::path& trace);

}  // namespace hapticd::drivers
