#pragma once

#include "tools/hapticctl/commands.h"

namespace hapticd::tools {

/// Prints the state again and again until Ctrl-C, or `count` times (0: no end): on a terminal as a table that
/// stands still, else line by line. Returns the exit code.
int runWatch(const CommandOptions& options, int interval_ms, int count);

}  // namespace hapticd::tools
