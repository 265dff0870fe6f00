// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>

#include "config/parameter_table.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/command_words.h"
#include "tools/hapticctl/error_text.h"

namespace hapticd::tools {
namespace {

using Kind = Takes::Kind;
using Commands = std::vector<CommandWords>;

// --- parameters

/// The names of parameters, separated by blanks, each with `suffix`.
std::string parameterNames(bool live_only, std::string_view suffix) {
  std::string names;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (live_only && parameter.effect != config::Effect::live) continue;
    names += fmt::format("{}{}{}", names.empty() ? "" : " ", parameter.name, suffix);
  }
  return names;
}

std::vector<std::string> wordsOf(const config::Parameter& parameter) {
  if (parameter.kind == config::Kind::boolean) return {"true", "false"};
  return {parameter.choices.begin(), parameter.choices.end()};
}

/// `line` for each live parameter that takes words, with its name and its words.
std::string choiceLines(const char* line) {
  std::string lines;
  for (const config::Parameter& parameter : config::parameterTable()) {
    const auto words = wordsOf(parameter);
    if (parameter.effect != config::Effect::live || words.empty()) continue;
    lines += fmt::format(fmt::runtime(line), fmt::arg("name", parameter.name),
                         fmt::arg("words", fmt::join(words, " ")));
  }
  return lines;
}

// --- commands

/// What each option takes, by its name; options of the same name take the same in all commands.
std::map<std::string, Takes> valueOptions(const Commands& commands) {
  std::map<std::string, Takes> options;
  for (const CommandWords& command : commands) {
    for (const OptionWord& option : command.options) {
      if (option.takes.kind != Kind::nothing) options[option.name] = option.takes;
    }
  }
  return options;
}

/// The options that take such a value, as a shell pattern: "--interval|--count".
std::string optionPattern(const Commands& commands, bool (*chosen)(Kind)) {
  std::vector<std::string> names;
  for (const auto& [name, takes] : valueOptions(commands)) {
    if (chosen(takes.kind)) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, "|"));
}

bool isFiles(Kind kind) {
  return kind == Kind::files;
}
bool isProfiles(Kind kind) {
  return kind == Kind::profiles;
}
/// The command that lists the names which the daemon has of such a thing; empty: it has none.
std::string_view listCommand(Kind kind) {
  if (kind == Kind::profiles) return "profiles";
  if (kind == Kind::fixtures) return "fixture list";
  if (kind == Kind::regions) return "region list";
  return kind == Kind::traces || kind == Kind::traces_or_files ? "trace list" : "";
}
bool isValue(Kind kind) {
  return kind != Kind::nothing;
}

/// Quotes a text for a shell, in single quotes.
std::string quoted(std::string text) {
  for (std::size_t place = 0; (place = text.find('\'', place)) != std::string::npos; place += 4) {
    text.replace(place, 1, "'\\''");
  }
  return "'" + text + "'";
}

const CommandWords& commandAt(const Commands& commands, const std::string& path) {
  return *std::ranges::find(commands, path, &CommandWords::path);
}

std::string below(const CommandWords& command, const std::string& name) {
  return command.path.empty() ? name : command.path + " " + name;
}

// --- bash

/// Lines of a shell's `case` over the command, with the words of each.
template <typename Words>
std::string bashCases(const Commands& commands, Words words) {
  std::string lines;
  for (const CommandWords& command : commands) {
    const std::string listed = words(command);
    if (!listed.empty()) lines += fmt::format("    \"{}\") echo \"{}\" ;;\n", command.path, listed);
  }
  return lines;
}

std::string optionNames(const CommandWords& command) {
  std::string names;
  for (const OptionWord& option : command.options) names += (names.empty() ? "" : " ") + option.name;
  return names;
}

std::string bashArgument(const CommandWords& command) {
  switch (command.argument.kind) {
    case Kind::files:
      return "@files";
    case Kind::words:
      return fmt::format("{}", fmt::join(command.argument.words, " "));
    case Kind::parameters:
      return parameterNames(false, "");
    case Kind::assignments:
      return "@assignments";
    case Kind::traces_or_files:
      return "@names_or_files trace list";
    default:
      break;
  }
  const std::string_view list = listCommand(command.argument.kind);
  return list.empty() ? "" : fmt::format("@names {}", list);
}

/// `line` for each option that takes words, with the pattern of its command and its name, and its words.
std::string optionWords(const Commands& commands, const char* line) {
  std::string lines;
  for (const CommandWords& command : commands) {
    const std::string path = command.path.empty() ? "*" : quoted(command.path);
    for (const OptionWord& option : command.options) {
      if (option.takes.kind != Kind::words) continue;
      lines += fmt::format(fmt::runtime(line), path, option.name, fmt::join(option.takes.words, " "));
    }
  }
  return lines;
}

constexpr std::string_view kBashScript =
    R"sh(# bash completion of hapticctl. Load it with: source <(hapticctl completion bash)
_hapticctl_commands() {{
  case "$1" in
{subcommands}  esac
}}
_hapticctl_options() {{
  case "$1" in
{options}  esac
}}
_hapticctl_argument() {{
  case "$1" in
{arguments}  esac
}}
_hapticctl_words() {{
  case "$1" in
{words}  esac
}}
_hapticctl_values() {{
  case "$1" in
{values}    *) ;;
  esac
}}
# The names that the daemon has; the caller sets the socket.
_hapticctl_names() {{
  hapticctl "${{socket[@]}}" "$@" --names 2>/dev/null
}}
_hapticctl() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD-1]}}" command="" index
  local -a socket=()
  COMPREPLY=()
  for ((index = 1; index < COMP_CWORD; index++)); do
    case "${{COMP_WORDS[index]}}" in
      --socket) ((index++)); socket=(--socket "${{COMP_WORDS[index]}}") ;;
      {value_options}) ((index++)) ;;
      -*) ;;
      *) [[ " $(_hapticctl_commands "$command") " == *" ${{COMP_WORDS[index]}} "* ]] &&
           command="${{command:+$command }}${{COMP_WORDS[index]}}" ;;
    esac
  done
  case "$previous" in
    {file_options}) COMPREPLY=($(compgen -f -- "$current")); return ;;
    {profile_options}) COMPREPLY=($(compgen -W "$(_hapticctl_names profiles)" -- "$current")); return ;;
    {value_options}) COMPREPLY=($(compgen -W "$(_hapticctl_words "$command:$previous")" -- "$current")); return ;;
  esac
  local argument="$(_hapticctl_argument "$command")"
  if [[ "$current" == -* ]]; then
    local options="$(_hapticctl_options "")"
    [[ -n "$command" ]] && options="$options $(_hapticctl_options "$command")"
    COMPREPLY=($(compgen -W "$options" -- "$current" | sort -u))
  elif [[ "$argument" == "@files" ]]; then
    COMPREPLY=($(compgen -f -- "$current"))
  elif [[ "$argument" == "@names"* ]]; then
    COMPREPLY=($(compgen -W "$(_hapticctl_names ${{argument#* }})" -- "$current"))
    [[ "$argument" == "@names_or_files "* ]] && COMPREPLY+=($(compgen -f -- "$current"))
  elif [[ "$argument" == "@assignments" ]]; then
    # bash makes '=' a word of its own.
    if [[ "$current" == "=" ]]; then
      COMPREPLY=($(compgen -W "$(_hapticctl_values "$previous")" -- ""))
    elif [[ "$previous" == "=" ]]; then
      COMPREPLY=($(compgen -W "$(_hapticctl_values "${{COMP_WORDS[COMP_CWORD-2]}}")" -- "$current"))
    else
      COMPREPLY=($(compgen -W "{assignments}" -- "$current"))
      compopt -o nospace 2>/dev/null
    fi
  else
    COMPREPLY=($(compgen -W "$(_hapticctl_commands "$command") $argument" -- "$current"))
  fi
}}
complete -F _hapticctl hapticctl
)sh";

std::string bashScript(const Commands& commands) {
  return fmt::format(kBashScript,
                     fmt::arg("subcommands", bashCases(commands,
                                                       [](const CommandWords& command) {
                                                         return fmt::format(
                                                             "{}", fmt::join(command.subcommands, " "));
                                                       })),
                     fmt::arg("options", bashCases(commands, optionNames)),
                     fmt::arg("arguments", bashCases(commands, bashArgument)),
                     fmt::arg("words", optionWords(commands, "    {}:{}) echo \"{}\" ;;\n")),
                     fmt::arg("values", choiceLines("    {name}) echo \"{words}\" ;;\n")),
                     fmt::arg("value_options", optionPattern(commands, isValue)),
                     fmt::arg("file_options", optionPattern(commands, isFiles)),
                     fmt::arg("profile_options", optionPattern(commands, isProfiles)),
                     fmt::arg("assignments", parameterNames(true, "=")));
}

// --- zsh

/// A word with its help for zsh: "'name:help'", with the colons of the help escaped.
std::string zshWord(const std::string& name, std::string help) {
  for (std::size_t place = 0; (place = help.find(':', place)) != std::string::npos; place += 2) {
    help.insert(place, "\\");
  }
  return quoted(name + ":" + help);
}

std::string zshOptions(const Commands& commands) {
  std::string lines;
  for (const CommandWords& command : commands) {
    lines += fmt::format("    ({}) options+=(", quoted(command.path));
    for (const OptionWord& option : command.options) lines += zshWord(option.name, option.help) + " ";
    lines += ") ;;\n";
  }
  return lines;
}

std::string zshArgument(const Commands& commands, const CommandWords& command) {
  switch (command.argument.kind) {
    case Kind::files:
      return "_files";
    case Kind::words:
      return fmt::format("compadd -- {}", fmt::join(command.argument.words, " "));
    case Kind::parameters:
      return "compadd -- " + parameterNames(false, "");
    case Kind::assignments:
      return "_hapticctl_assignments";
    case Kind::traces_or_files:
      return "_hapticctl_names trace list; _files";
    default:
      break;
  }
  if (const auto list = listCommand(command.argument.kind); !list.empty())
    return fmt::format("_hapticctl_names {}", list);
  if (command.subcommands.empty()) return "";
  std::string words = "subcommands=(";
  for (const std::string& name : command.subcommands) {
    words += zshWord(name, commandAt(commands, below(command, name)).help) + " ";
  }
  return words + "); _describe command subcommands";
}

std::string zshArguments(const Commands& commands) {
  std::string lines;
  for (const CommandWords& command : commands) {
    lines += fmt::format("    ({}) {} ;;\n", quoted(command.path), zshArgument(commands, command));
  }
  return lines;
}

/// The steps from a command to a command below it, as a pattern: "':status'|'trace:start'".
std::string zshSteps(const Commands& commands) {
  std::vector<std::string> steps;
  for (const CommandWords& command : commands) {
    for (const std::string& name : command.subcommands) steps.push_back(quoted(command.path + ":" + name));
  }
  return fmt::format("{}", fmt::join(steps, "|"));
}

constexpr std::string_view kZshScript =
    R"sh(#compdef hapticctl
# zsh completion of hapticctl. Load it with: source <(hapticctl completion zsh)
_hapticctl_assignments() {{
  case "$PREFIX" in
{values}    (*) compadd -S '' -- {assignments} ;;
  esac
}}
# The names that the daemon has; the caller sets the socket.
_hapticctl_names() {{
  compadd -- ${{(f)"$(hapticctl $socket "$@" --names 2>/dev/null)"}}
}}
_hapticctl() {{
  local command="" word index
  local -a subcommands options socket
  for ((index = 2; index < CURRENT; index++)); do
    word="$words[index]"
    case "$word" in
      (--socket) ((index++)); socket=(--socket "$words[index]") ;;
      ({value_options}) ((index++)) ;;
      (-*) ;;
      (*) case "$command:$word" in
            ({steps}) command="${{command:+$command }}$word" ;;
          esac ;;
    esac
  done
  case "$words[CURRENT-1]" in
    ({file_options}) _files; return ;;
    ({profile_options}) _hapticctl_names profiles; return ;;
  esac
  case "$command:$words[CURRENT-1]" in
{words}    (*:({value_options})) return ;;
  esac
  if [[ "$PREFIX" == -* ]]; then
    for word in "" $command; do
      case "$word" in
{options}      esac
    done
    _describe option options
    return
  fi
  case "$command" in
{arguments}  esac
}}
# zsh calls this file as a function when it finds it in fpath
if [[ "${{funcstack[1]}}" == _hapticctl ]]; then
  _hapticctl "$@"
elif (( $+functions[compdef] )); then
  compdef _hapticctl hapticctl
fi
)sh";

std::string zshScript(const Commands& commands) {
  return fmt::format(
      kZshScript, fmt::arg("values", choiceLines("    ({name}=*) compset -P '*='; compadd -- {words} ;;\n")),
      fmt::arg("assignments", parameterNames(true, "=")),
      fmt::arg("value_options", optionPattern(commands, isValue)),
      fmt::arg("file_options", optionPattern(commands, isFiles)),
      fmt::arg("profile_options", optionPattern(commands, isProfiles)), fmt::arg("steps", zshSteps(commands)),
      fmt::arg("words", optionWords(commands, "    ({}:{}) compadd -- {}; return ;;\n")),
      fmt::arg("options", zshOptions(commands)), fmt::arg("arguments", zshArguments(commands)));
}

// --- fish

/// The condition under which fish offers the words of a command: each word of its path has been typed.
std::string fishCondition(const CommandWords& command) {
  if (command.path.empty()) return "";
  std::string condition = "__fish_seen_subcommand_from " + command.path;
  const std::size_t blank = command.path.find(' ');
  if (blank != std::string::npos) {
    condition = fmt::format("__fish_seen_subcommand_from {}; and __fish_seen_subcommand_from {}",
                            command.path.substr(0, blank), command.path.substr(blank + 1));
  }
  return " -n " + quoted(condition);
}

/// The part of a line that offers the names which the daemon has of such a thing; empty: it has none.
std::string fishNames(Kind kind) {
  const std::string_view list = listCommand(kind);
  return list.empty() ? "" : fmt::format(" -a '(__hapticctl_names {})'", list);
}

std::string fishOptions(const CommandWords& command) {
  std::string lines;
  for (const OptionWord& option : command.options) {
    const bool long_name = option.name.starts_with("--");
    std::string value = option.takes.kind == Kind::nothing ? ""
                        : option.takes.kind == Kind::files ? " -r -F"
                                                           : " -x";
    if (option.takes.kind == Kind::words)
      value += fmt::format(" -a '{}'", fmt::join(option.takes.words, " "));
    value += fishNames(option.takes.kind);
    lines +=
        fmt::format("complete -c hapticctl{} -{} {}{} -d {}\n", fishCondition(command), long_name ? "l" : "s",
                    option.name.substr(long_name ? 2 : 1), value, quoted(option.help));
  }
  return lines;
}

std::string fishAssignments(const std::string& condition) {
  std::string lines = fmt::format("complete -c hapticctl{} -a '{}'\n", condition, parameterNames(true, "="));
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.effect != config::Effect::live) continue;
    for (const std::string& word : wordsOf(parameter)) {
      lines += fmt::format("complete -c hapticctl{} -a '{}={}'\n", condition, parameter.name, word);
    }
  }
  return lines;
}

std::string fishArgument(const CommandWords& command) {
  const std::string condition = fishCondition(command);
  switch (command.argument.kind) {
    case Kind::files:
      return fmt::format("complete -c hapticctl{} -F\n", condition);
    case Kind::words:
      return fmt::format("complete -c hapticctl{} -a '{}'\n", condition,
                         fmt::join(command.argument.words, " "));
    case Kind::parameters:
      return fmt::format("complete -c hapticctl{} -a '{}'\n", condition, parameterNames(false, ""));
    case Kind::assignments:
      return fishAssignments(condition);
    case Kind::traces_or_files:
      return fmt::format("complete -c hapticctl{} -F{}\n", condition, fishNames(command.argument.kind));
    default:
      break;
  }
  const std::string names = fishNames(command.argument.kind);
  return names.empty() ? "" : fmt::format("complete -c hapticctl{}{}\n", condition, names);
}

std::string fishSubcommands(const Commands& commands, const CommandWords& command) {
  const std::string none_of_them =
      fmt::format("not __fish_seen_subcommand_from {}", fmt::join(command.subcommands, " "));
  const std::string condition =
      quoted(command.path.empty()
                 ? none_of_them
                 : fmt::format("__fish_seen_subcommand_from {}; and {}", command.path, none_of_them));
  std::string lines;
  for (const std::string& name : command.subcommands) {
    lines += fmt::format("complete -c hapticctl -n {} -a {} -d {}\n", condition, name,
                         quoted(commandAt(commands, below(command, name)).help));
  }
  return lines;
}

std::string fishScript(const Commands& commands) {
  std::string script =
      "# fish completion of hapticctl. Load it with: hapticctl completion fish | source\n"
      "# The names that the daemon has, at the socket of the command line.\n"
      "function __hapticctl_names\n"
      "  set -l typed (commandline -opc)\n"
      "  set -l socket\n"
      "  if set -l at (contains -i -- --socket $typed)\n"
      "    set socket --socket $typed[(math $at + 1)]\n"
      "  end\n"
      "  hapticctl $socket $argv --names 2>/dev/null\n"
      "end\n"
      "complete -c hapticctl -f\n";
  for (const CommandWords& command : commands) {
    script += fishOptions(command) + fishSubcommands(commands, command) + fishArgument(command);
  }
  return script;
}

}  // namespace

std::string completionScript(std::string_view shell, const CLI::App& app) {
  const Commands commands = commandWordsOf(app);
  if (shell == "zsh") return zshScript(commands);
  return shell == "fish" ? fishScript(commands) : bashScript(commands);
}

void addCompletionCommand(CommandLine& line) {
  const auto shell = std::make_shared<std::string>();
  line.add("completion", "Print the completion script of a shell: source <(hapticctl completion bash)",
           [&line, shell] {
             fmt::print("{}", completionScript(*shell, line.app()));
             return static_cast<int>(kOk);
           })
      .add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace hapticd::tools
