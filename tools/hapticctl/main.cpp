// SPDX-License-Identifier: Apache-2.0
#include "config/program.h"
#include "tools/hapticctl/command_line.h"

namespace {

int run(int argc, char** argv) {
  using namespace hapticd::tools;
  CommandLine line;
  addStateCommands(line);
  addControlCommands(line);
  addProfileCommands(line);
  addFixtureCommands(line);
  addRegionCommands(line);
  addTraceCommands(line);
  addSnapshotCommand(line);
  addViewCommand(line);
  addRegisterCommand(line);
  addCalibrateCommand(line);
  addCameraCommands(line);
  addDoctorCommand(line);
  addCompletionCommand(line);
  addHelpCommand(line);
  return line.run(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  return hapticd::config::runProgram("hapticctl", [&] { return run(argc, argv); });
}
