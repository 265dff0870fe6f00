// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/program.h"
#include "config/base/value_text.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kColumns = 80;

std::string wrappedLines(const std::string& text, std::size_t columns) {
  std::istringstream lines(text);
  std::string all;
  for (std::string line; std::getline(lines, line);) {
    all += (all.empty() ? "" : "\n") + wrapped(line, columns, "");
  }
  return all;
}

/// "csv, recording" from "{csv,recording}".
std::string spaced(std::string words) {
  words = words.substr(1, words.size() - 2);
  for (std::size_t comma = 0; (comma = words.find(',', comma)) != std::string::npos; comma += 2) {
    words.insert(comma + 1, " ");
  }
  return words;
}

}  // namespace

std::string HelpFormatter::row(const std::string& name, const std::string& text) const {
  std::ostringstream out;
  CLI::detail::format_help(out, name, wrappedLines(text, kColumns - column_width_), column_width_);
  return out.str();
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional) + make_option_opts(option);
  std::string text = make_option_desc(option);
  const std::size_t open = name.find(":{");
  const std::size_t close = name.find('}');
  if (2 + name.size() > kColumns && open != std::string::npos && close != std::string::npos) {
    text += ": " + spaced(name.substr(open + 1, close - open));
    name.erase(open, close + 1 - open);
  }
  return row(name, text);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return row(command->get_display_name(true), command->get_description());
}

std::string HelpFormatter::make_footer(const CLI::App* command) const {
  const std::string footer = command->get_footer();
  return footer.empty() ? footer : wrappedLines(footer, kColumns) + "\n\n";
}

namespace {

constexpr const char* kFooter =
    "Times are in UTC, as in the names of traces. On a terminal tables are fitted to\n"
    "its width; piped into a file or a program they are not shortened.\n"
    "Exit status: 0 done, 1 refused by the daemon or failed, 2 wrong usage, 3 no\n"
    "connection to the daemon.\n"
    "Socket: --socket, else HAPTICD_SOCKET, else /run/hapticd/io.hapticd.Control;\n"
    "commands that only read also try /run/hapticd/io.hapticd.Status.\n";

/// Reports a word that stands where a command was expected; false where the command line lacks something
/// else.
bool reportUnknownCommand(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining(true);
  const auto word =
      std::ranges::find_if(words, [](const std::string& text) { return !text.starts_with('-'); });
  const CLI::App* group = &app;
  while (!group->get_subcommands().empty()) group = group->get_subcommands().front();
  const bool has_commands = !group->get_subcommands([](const CLI::App*) { return true; }).empty();
  if (word == words.end() || !has_commands) return false;
  const std::string path = base::commandPath(app);
  base::printUsageError(path, unknownCommand(*group, path, *word));
  return true;
}

}  // namespace

std::string unknownCommand(const CLI::App& group, const std::string& path, const std::string& word) {
  std::vector<std::string_view> names;
  for (const CLI::App* command : group.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  const std::string meant = base::didYouMean(word, names);
  return fmt::format("there is no command '{} {}'{}", path, printable(word),
                     meant.empty() ? "" : " (" + meant + ")");
}

CommandLine::CommandLine() : app_("Queries and tunes a running hapticd", "hapticctl") {
  app_.formatter(std::make_shared<HelpFormatter>());  // inherited by all commands
  app_.set_version_flag("-V,--version", "hapticctl " HAPTICD_VERSION);
  app_.add_flag("--json", options_.json, "Print the daemon's reply as JSON");
  app_.add_option("--socket", options_.socket, "Socket of the daemon")->type_name("PATH");
  app_.add_option("--color", options_.color,
                  "Colours: auto (on a terminal, unless NO_COLOR is set), always or never")
      ->type_name("WHEN")
      ->check(CLI::IsMember({"auto", "always", "never"}));
  app_.require_subcommand(1);
  app_.fallthrough();
  app_.footer(kFooter);
}

CLI::App& CommandLine::add(const std::string& name, const std::string& help, Action action) {
  return add(app_, name, help, std::move(action));
}

CLI::App& CommandLine::addGroup(const std::string& name, const std::string& help) {
  CLI::App* group = app_.add_subcommand(name, help);
  group->require_subcommand(1);
  group->footer(kFooter);
  return *group;
}

CLI::App& CommandLine::add(CLI::App& group, const std::string& name, const std::string& help, Action action) {
  CLI::App* command = group.add_subcommand(name, help);
  command->footer(kFooter);
  command->callback([this, action = std::move(action)] { action_ = action; });
  return *command;
}

int CommandLine::run(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    return reportUnknownCommand(app_) ? kUsage : base::endWithoutWork(app_, error, kUsage);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app_, error, kUsage);
  }
  return action_();
}

void addForce(CLI::App& command, base::IfExists& if_exists, const char* help) {
  command.add_flag_callback(
      "--force", [&if_exists] { if_exists = base::IfExists::replace; }, help);
}

CLI::Option* addNames(CLI::App& command, bool& names_only) {
  return command.add_flag("--names", names_only, "Print only the names, one a line");
}

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
      base::printUsageError(path, unknownCommand(*command, path, word));
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
