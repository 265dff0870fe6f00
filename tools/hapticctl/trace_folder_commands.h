// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticctl/command_line.h"

namespace hapticd::tools {

/// Adds the commands for the daemon's folder of traces to the group `trace`: list, delete, keep, note.
void addTraceFolderCommands(CommandLine& line, CLI::App& group);

}  // namespace hapticd::tools
