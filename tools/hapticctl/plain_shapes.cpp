// SPDX-License-Identifier: Apache-2.0
// What hapticctl itself knows of shapes: none of the options that take a mesh, a label map or a model. Where
// one of them is given, the parser does not know it, and hapticctl-shapes, which does, gets the command line.
// So no function here that would use one is ever called.
#include <cstdlib>
#include <memory>
#include <optional>

#include "tools/hapticctl/additions/markups.h"
#include "tools/hapticctl/additions/solid_source.h"
#include "tools/hapticctl/base/command_line.h"

namespace hapticd::tools {

void addSolidOptions(CLI::App&, const std::shared_ptr<SolidSource>&) {}

std::optional<int> refusedWithoutSource(const SolidSource&, bool) {
  return std::nullopt;
}

int addSolid(const CommandOptions&, const SolidSource&, Json, bool) {
  std::abort();
}

void addModelOptions(CLI::App&, const std::shared_ptr<ModelOptions>&) {}

std::expected<config::SceneAdditions, int> registered(const CommandOptions&, const ModelOptions&,
                                                      const config::SceneAdditions&, Json&) {
  std::abort();
}

base::Result<MarkupFixtures> fixturesOfMarkups(const std::string&) {
  std::abort();
}

void addFixtureTouch(CommandLine& line, CLI::App&) {
  line.addHelped("fixture touch");
}

}  // namespace hapticd::tools
