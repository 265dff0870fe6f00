// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/base/command_line.h"

namespace hapticd::tools {

/// The hidden command `hapticctl __complete WORD...`, which the shells' completions call: prints what may
/// stand in place of the last of `typed`, the words behind `hapticctl` up to the cursor. One candidate a
/// line, behind it a tab and its help where it has one; `:files` stands for the names of files. Commands,
/// options and their words are those of `line`, parameters those of the parameter table, and what has a name
/// in the daemon is asked for. A candidate that ends with '=' is not followed by a blank. Returns the exit
/// code.
int printCandidates(const CommandLine& line, const std::vector<std::string>& typed);

}  // namespace hapticd::tools
