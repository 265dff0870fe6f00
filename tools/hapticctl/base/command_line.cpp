// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/command_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/program.h"
#include "config/base/value_text.h"
#include "tools/hapticctl/base/command_words.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kMachine = "hapticctl-machine";
constexpr const char* kRegister = "hapticctl-register";
constexpr const char* kShapes = "hapticctl-shapes";
constexpr const char* kTrace = "hapticctl-trace";

constexpr std::array kHelped{
    HelpedCommand{"trace info", kTrace, "Check a trace and show what it contains"},
    HelpedCommand{"trace breaches", kTrace,
                  "Report how often, how long and how deep the HIP was in forbidden regions"},
    HelpedCommand{"trace export", kTrace, "Write a trace in a format that other programs read"},
    HelpedCommand{"trace recover", kTrace,
                  "Save the intact parts of a damaged or cut off trace into a new file"},
    HelpedCommand{"trace plot", kTrace,
                  "Draw forces, penetration, modes, events and latency of a trace with gnuplot"},
    HelpedCommand{"register", kRegister,
                  "Find the pose of the camera from points that are known to it and in the world"},
    HelpedCommand{"calibrate", kRegister, "Measure how stiff the surface may be, and what limits it"},
    HelpedCommand{"camera list", kMachine, "List the connected cameras, and the one that hapticd uses"},
    HelpedCommand{"camera test", kMachine, "Measure rate, holes and noise of a camera of the driver v4l2"},
    HelpedCommand{"handle list", kMachine, "List the connected handles, and what hapticd needs to use them"},
    HelpedCommand{"doctor", kMachine, "Check kernel, CPUs, rights, devices, traces and service"},
    HelpedCommand{"fixture touch", kShapes, "Add a fixture whose shape is touched with the handle"},
    // what hapticctl does too, without the options that take a mesh, a label map or a model
    HelpedCommand{"fixture add", kShapes, nullptr},
    HelpedCommand{"fixture import", kShapes, nullptr},
    HelpedCommand{"region import", kShapes, nullptr},
};

}  // namespace

const HelpedCommand* helpedCommand(std::string_view path) {
  const auto* const found = std::ranges::find(kHelped, path, &HelpedCommand::path);
  return found == kHelped.end() ? nullptr : found;
}

base::Error executeHelper(const HelpedCommand& command, char** arguments) {
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const auto folder = (program.parent_path() / HAPTICCTL_HELPERS).lexically_normal();
  const std::string helper = folder / command.helper;
  ::execv(helper.c_str(), arguments);
  return {helper, fmt::format("'{}' cannot be executed: {}", command.path, std::strerror(errno)),
          "install all of hapticd; in a build: cmake --build FOLDER --target hapticctl_helpers"};
}

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
    "Commands that only show or record may be shortened: 'tr li' for 'trace list'.\n"
    "Exit status: 0 done, 1 refused by the daemon or failed, 2 wrong usage, 3 no\n"
    "connection to the daemon.\n"
    "Socket: --socket, else HAPTICD_SOCKET, else /run/hapticd/io.hapticd.Control;\n"
    "commands that only read also try /run/hapticd/io.hapticd.Status.\n";

/// The words that a parser's text lists in braces: "auto, always, never".
std::string listed(const std::string& text) {
  const std::size_t open = text.find('{');
  const std::size_t close = text.find('}', open);
  return close == std::string::npos ? text.substr(open + 1) : spaced(text.substr(open, close + 1 - open));
}

/// "a, b, c" for the commands of a group.
std::string namesIn(const CLI::App& group) {
  std::string names;
  for (const CLI::App* command : commandsOf(group))
    names += (names.empty() ? "" : ", ") + command->get_name();
  return names;
}

/// The command that the arguments name, or the group.
const CLI::App& namedIn(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

/// What is wrong with a command line, in the words of this program instead of the parser's.
std::string usageText(const CLI::App& app, const CLI::ParseError& error) {
  const std::string text = error.what();
  const auto part = [&text](std::size_t begin, std::size_t end) {
    return printable(text.substr(begin, end == std::string::npos ? end : end - begin));
  };
  std::string extras;
  for (const std::string& word : app.remaining(true)) extras += (extras.empty() ? "" : " ") + word;
  const bool lacks_command = text == "A subcommand is required";
  if (lacks_command && extras.empty()) return fmt::format("a command is required: {}", namesIn(namedIn(app)));
  if (lacks_command || dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)
    return fmt::format("not expected here: {}", printable(extras));
  if (constexpr std::string_view kNoNumber = "Could not convert: "; text.starts_with(kNoNumber)) {
    const std::size_t equals = text.find(" = ");
    if (equals == std::string::npos) return printable(text);
    return fmt::format("{}: {} is not a number", part(kNoNumber.size(), equals),
                       base::inQuotes(text.substr(equals + 3)));
  }
  if (const std::size_t missing = text.find(": 1 required "); missing != std::string::npos) {
    const std::size_t type = missing + std::string_view(": 1 required ").size();
    return fmt::format("{}: its value is missing ({})", part(0, missing), part(type, text.rfind(" missing")));
  }
  if (const std::size_t outside = text.find(" not in {"); outside != std::string::npos) {
    const std::size_t value = text.find(": ") + 2;
    return fmt::format("{}{} is not one of: {}", part(0, value),
                       base::inQuotes(text.substr(value, outside - value)), listed(text.substr(outside)));
  }
  return printable(text);
}

}  // namespace

CommandLine::CommandLine(bool is_helper)
    : app_("Queries and tunes a running hapticd", "hapticctl"), is_helper_(is_helper) {
  app_.formatter(std::make_shared<HelpFormatter>());  // inherited by all commands
  app_.set_version_flag("-V,--version", "hapticctl " HAPTICD_VERSION);
  app_.add_flag("--json", options_.json, "Print what the text says as JSON; streams an object a line");
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

CLI::App& CommandLine::addHelped(const std::string& path, Action action) {
  const HelpedCommand* const command = helpedCommand(path);
  const std::size_t blank = path.find(' ');
  if (blank == std::string::npos) return add(path, command->help, std::move(action));
  const std::string name = path.substr(0, blank);
  const auto groups = app_.get_subcommands([&](const CLI::App* one) { return one->get_name() == name; });
  CLI::App& group = groups.empty() ? addGroup(name, "") : *groups.front();
  return add(group, path.substr(blank + 1), command->help, std::move(action));
}

void CommandLine::addAllHelped(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) addHelped(path);
}

const HelpedCommand* CommandLine::helped(const CLI::App& command) const {
  if (is_helper_ || command.get_parent() == nullptr) return nullptr;
  std::string path = command.get_name();
  for (const CLI::App* above = command.get_parent(); above->get_parent() != nullptr;
       above = above->get_parent()) {
    path = above->get_name() + " " + path;
  }
  return helpedCommand(path);
}

int CommandLine::runHelper(const HelpedCommand& command) const {
  return report(executeHelper(command, arguments_), options_.json);
}

int CommandLine::run(int argc, char** argv) {
  arguments_ = argv;
  if (argc > 1 && argv[1] == std::string_view("__complete"))
    return printCandidates(*this, {argv + 2, argv + argc});
  const auto full = withFullNames(app_, {argv + 1, argv + argc});
  // the parser may fail before it has read --json
  const bool json = std::find(argv + 1, argv + argc, std::string_view("--json")) != argv + argc;
  if (!full) return reportUsage(full.error().path, full.error().what, json);
  std::vector<std::string> words(full->rbegin(), full->rend());  // the parser takes the last one first
  try {
    app_.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    // the helper has the options, and says what is wrong with them
    if (const HelpedCommand* const command = helped(namedIn(app_))) return runHelper(*command);
    if (error.get_exit_code() == 0) return base::endWithoutWork(app_, error, kUsage);
    return reportUsage(base::commandPath(app_), usageText(app_, error), json);
  }
  const HelpedCommand* const command = helped(namedIn(app_));
  return command != nullptr && command->help != nullptr ? runHelper(*command) : action_();
}

int runCommandLine(int argc, char** argv, bool is_helper, void (*add)(CommandLine& line)) {
  return base::runProgram("hapticctl", [=] {
    CommandLine line(is_helper);
    add(line);
    addHelpCommand(line);
    return line.run(argc, argv);
  });
}

void addForce(CLI::App& command, base::IfExists& if_exists, const char* help) {
  command.add_flag_callback(
      "--force", [&if_exists] { if_exists = base::IfExists::replace; }, help);
}

CLI::Option* addNames(CLI::App& command, bool& names_only) {
  return command.add_flag("--names", names_only, "Print only the names, one a line");
}

namespace {

/// The help of a command as an object: its text, and its commands with what each is for.
Json helpJson(const CLI::App& command, const std::string& path, const std::string& text) {
  Json commands = Json::array();
  for (const CLI::App* below : commandsOf(command)) {
    const std::string full = path + " " + below->get_name();
    commands.push_back({{"name", below->get_name()},
                        {"description", below->get_description()},
                        {"mayBeShortened", mayBeShortened(full.substr(full.find(' ') + 1))}});
  }
  return {{"command", path}, {"commands", std::move(commands)}, {"text", text}};
}

int runHelp(const CommandLine& line, const std::vector<std::string>& words) {
  const CommandOptions& options = line.options();
  const CLI::App& app = line.app();
  const CLI::App* command = &app;
  std::string path = "hapticctl";
  for (const std::string& word : words) {
    const CLI::App* const below = commandFor(*command, word);
    if (below == nullptr) {
      const WrongWord wrong = wrongWord(app, *command, path, word);
      return reportUsage(wrong.path, wrong.what, options.json);
    }
    command = below;
    path += " " + below->get_name();
  }
  if (const HelpedCommand* const helped = line.helped(*command)) return line.runHelper(*helped);
  const std::string text = command->get_formatter()->make_help(command, path, CLI::AppFormatMode::Normal);
  if (options.json) {
    printJson(helpJson(*command, path, text));
  } else {
    fmt::print("{}", text);
  }
  return kOk;
}

}  // namespace

void addHelpCommand(CommandLine& line) {
  const auto words = std::make_shared<std::vector<std::string>>();
  line.add("help", "Show the help of hapticctl, or of a command",
           [&line, words] { return runHelp(line, *words); })
      .add_option("COMMAND", *words, "The command, such as trace list")
      ->type_name("COMMAND");
}

}  // namespace hapticd::tools
