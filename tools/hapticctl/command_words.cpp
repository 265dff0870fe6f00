// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/command_words.h"

#include <algorithm>

namespace hapticd::tools {
namespace {

/// The words of "TYPE:{csv,recording}".
std::vector<std::string> wordsIn(const std::string& type) {
  std::vector<std::string> words;
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return words;
  for (std::size_t begin = open + 1; begin < close;) {
    const std::size_t end = std::min(type.find(',', begin), close);
    words.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

Takes takenBy(const CLI::Option& option) {
  using Kind = Takes::Kind;
  if (option.get_items_expected_max() == 0) return {};
  const std::string type = option.get_type_name();
  std::vector<std::string> words = wordsIn(type);
  if (!words.empty()) return {Kind::words, std::move(words)};
  if (type == "COMMAND") return {Kind::words, {}};  // filled in by commandWordsOf()
  if (type == "PARAMETER") return {Kind::parameters, {}};
  if (type == "PARAMETER=VALUE") return {Kind::assignments, {}};
  if (type == "PROFILE") return {Kind::profiles, {}};
  if (type == "FIXTURE") return {Kind::fixtures, {}};
  if (type == "REGION") return {Kind::regions, {}};
  if (type == "TRACE") return {Kind::traces, {}};
  if (type == "NAME|FILE") return {Kind::traces_or_files, {}};
  const bool file = type == "FILE" || type == "PATH" || type == "FOLDER";
  return {file ? Kind::files : Kind::anything, {}};
}

/// Shells show a help in one line beside the word.
std::string inOneLine(std::string help) {
  std::ranges::replace(help, '\n', ' ');
  return help;
}

void addWords(const CLI::App& app, const std::string& path, std::vector<CommandWords>& all) {
  CommandWords own{path, inOneLine(app.get_description()), {}, {}, {}};
  for (const CLI::Option* option : app.get_options({})) {
    const Takes takes = takenBy(*option);
    if (option->get_positional() && own.argument.kind == Takes::Kind::nothing) own.argument = takes;
    for (const std::string& name : option->get_lnames()) {
      own.options.push_back({"--" + name, inOneLine(option->get_description()), takes});
    }
    for (const std::string& name : option->get_snames()) {
      own.options.push_back({"-" + name, inOneLine(option->get_description()), takes});
    }
  }
  const std::vector<const CLI::App*> below = app.get_subcommands({});
  for (const CLI::App* subcommand : below) own.subcommands.push_back(subcommand->get_name());
  all.push_back(std::move(own));
  for (const CLI::App* subcommand : below) {
    addWords(*subcommand, path.empty() ? subcommand->get_name() : path + " " + subcommand->get_name(), all);
  }
}

}  // namespace

std::vector<CommandWords> commandWordsOf(const CLI::App& app) {
  std::vector<CommandWords> all;
  addWords(app, "", all);
  for (CommandWords& command : all) {
    const bool takes_command = command.argument.kind == Takes::Kind::words && command.argument.words.empty();
    if (takes_command) command.argument.words = all.front().subcommands;
  }
  return all;
}

}  // namespace hapticd::tools
