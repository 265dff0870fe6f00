// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "config/program.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"

namespace hapticd::tools {
namespace {

/// Returns the subcommand with that name; null if there is none.
const CLI::App* subcommandOf(const CLI::App& app, const std::string& name) {
  const auto all = app.get_subcommands([](const CLI::App*) { return true; });
  const auto found =
      std::ranges::find(all, name, [](const CLI::App* command) { return command->get_name(); });
  return found == all.end() ? nullptr : *found;
}

int runHelp(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  std::string path = "hapticctl";
  for (const std::string& word : words) {
    const CLI::App* const below = subcommandOf(*command, word);
    if (below == nullptr) {
      config::printUsageError(path, unknownCommand(*command, path, word));
      return kUsage;
    }
    command = below;
    path += " " + word;
  }
  fmt::print("{}", command->get_formatter()->make_help(command, path, CLI::AppFormatMode::Normal));
  return kOk;
}

}  // namespace

void addHelpCommand(CommandLine& line) {
  const auto words = std::make_shared<std::vector<std::string>>();
  line.add("help", "Show the help of hapticctl, or of a command",
           [&line, words] { return runHelp(line.app(), *words); })
      .add_option("COMMAND", *words, "The command, such as: trace list")
      ->type_name("COMMAND");
}

}  // namespace hapticd::tools
