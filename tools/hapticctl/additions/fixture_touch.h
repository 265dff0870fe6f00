// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticctl/base/command_line.h"

namespace hapticd::tools {

/// Adds `touch` to the group of the fixtures: a fixture whose shape is measured with the handle.
void addFixtureTouch(CommandLine& line, CLI::App& group);

}  // namespace hapticd::tools
