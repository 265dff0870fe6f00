// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/command_line.h"

namespace {

void addCommands(hapticd::tools::CommandLine& line) {
  using namespace hapticd::tools;
  addStateCommands(line);
  addControlCommands(line);
  addProfileCommands(line);
  addFixtureCommands(line);
  addRegionCommands(line);
  addFrameCommands(line);
  addTraceCommands(line);
  addSnapshotCommand(line);
  addViewCommand(line);
  line.addAllHelped({"register", "calibrate"});
  line.addGroup("camera", "Connected cameras, and what they deliver");
  line.addAllHelped({"camera list", "camera test"});
  line.addGroup("handle", "Connected haptic handles");
  line.addHelped("handle list");
  addRosCommand(line);
  line.addHelped("doctor");
  addCompletionCommand(line);
}

}  // namespace

int main(int argc, char** argv) {
  return hapticd::tools::runCommandLine(argc, argv, /*is_helper=*/false, addCommands);
}
