// SPDX-License-Identifier: Apache-2.0
// hapticctl-shapes: the commands of hapticctl that make fixtures of meshes, label maps, models and touches.
#include "tools/hapticctl/base/command_line.h"

namespace {

void addCommands(hapticd::tools::CommandLine& line) {
  addFixtureCommands(line);
  addRegionCommands(line);
}

}  // namespace

int main(int argc, char** argv) {
  return hapticd::tools::runCommandLine(argc, argv, /*is_helper=*/true, addCommands);
}
