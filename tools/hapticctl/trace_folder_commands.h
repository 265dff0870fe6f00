// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "tools/hapticctl/command_line.h"

namespace hapticd::tools {

/// How long calls about traces may take: a disk may need long to write the end of a file.
inline constexpr std::chrono::seconds kDiskLimit{15};

/// Adds the commands for the daemon's folder of traces to the group `trace`: list, delete, keep, note.
void addTraceFolderCommands(CommandLine& line, CLI::App& group);

}  // namespace hapticd::tools
