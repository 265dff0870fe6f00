// SPDX-License-Identifier: Apache-2.0
#include <string_view>

#include "config/base/program.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/completion.h"

namespace {

int run(int argc, char** argv) {
  using namespace hapticd::tools;
  CommandLine line;
  addStateCommands(line);
  addControlCommands(line);
  addProfileCommands(line);
  addFixtureCommands(line);
  addRegionCommands(line);
  addFrameCommands(line);
  addTraceCommands(line);
  addSnapshotCommand(line);
  addViewCommand(line);
  addRegisterCommand(line);
  addCalibrateCommand(line);
  addCameraCommands(line);
  addHandleCommands(line);
  addRosCommand(line);
  addDoctorCommand(line);
  addCompletionCommand(line);
  addHelpCommand(line);
  if (argc > 1 && argv[1] == std::string_view("__complete"))
    return printCandidates(line, {argv + 2, argv + argc});
  return line.run(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticctl", [&] { return run(argc, argv); });
}
