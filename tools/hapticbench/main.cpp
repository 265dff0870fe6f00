// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "config/base/program.h"
#include "tools/hapticbench/engine/study.h"

namespace hapticd::tools {
namespace {

int run(int argc, char** argv) {
  CLI::App app{"hapticbench: what the force laws of hapticd cost and how accurate they are, side by side"};
  app.require_subcommand(1);
  app.set_version_flag("-V,--version", std::string("hapticbench ") + HAPTICD_VERSION);
  const std::vector<StudyCommand> commands{
      accuracyCommand(app),  buzzCommand(app),       camerasCommand(app), fixturesCommand(app),
      godobjectCommand(app), jitterCommand(app),     noiseCommand(app),   occlusionCommand(app),
      paretoCommand(app),    recordingsCommand(app), solidsCommand(app),  stabilityCommand(app),
      strokesCommand(app),   trackingCommand(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return std::ranges::find_if(commands, &StudyCommand::chosen)->run();
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticbench", [&] { return hapticd::tools::run(argc, argv); });
}
