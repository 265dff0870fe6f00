// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string_view>

#include "config/settings/parameter_table.h"
#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/base/command_words.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

/// Words with their help; each once, in alphabetical order.
using Candidates = std::map<std::string, std::string>;

constexpr const char* kFiles = ":files";

/// Where the daemon lists the names that an argument of that type may have.
struct NameList {
  const char* type;
  const char* method;
  const char* member;
};
constexpr NameList kNameLists[] = {{"PROFILE", "io.hapticd.Status.ListProfiles", "profiles"},
                                   {"FIXTURE", "io.hapticd.Status.ListFixtures", "fixtures"},
                                   {"REGION", "io.hapticd.Status.ListRegions", "regions"},
                                   {"FRAME", "io.hapticd.Status.ListFrames", "frames"},
                                   {"TRACE", "io.hapticd.Status.ListTraces", "traces"},
                                   {"NAME|FILE", "io.hapticd.Status.ListTraces", "traces"}};

void addCommands(const CLI::App& group, Candidates& to) {
  for (const CLI::App* command : commandsOf(group)) to[command->get_name()] = command->get_description();
}

void addOptions(const CLI::App& command, Candidates& to) {
  for (const CLI::Option* option : command.get_options({})) {
    for (const std::string& name : option->get_lnames()) to["--" + name] = option->get_description();
    for (const std::string& name : option->get_snames()) to["-" + name] = option->get_description();
  }
}

/// Adds the words of a type like "FORMAT:{csv,recording}".
void addWords(const std::string& type, Candidates& to) {
  const std::size_t open = type.find('{');
  if (open == std::string::npos) return;
  for (const std::string& word : CLI::detail::split(type.substr(open + 1, type.find('}') - open - 1), ','))
    to[word];
}

/// Adds "NAME=" for each live parameter, or "NAME=WORD" for each word of the one that `typed` names.
void addAssignments(const std::string& typed, Candidates& to) {
  const std::size_t equals = typed.find('=');
  for (const config::Parameter& parameter : config::parameterTable()) {
    const std::string name(parameter.name);
    if (parameter.effect != config::Effect::live) continue;
    if (equals == std::string::npos) {
      to[name + "="];
    } else if (name == typed.substr(0, equals)) {
      for (const std::string_view word : parameter.choices) to[fmt::format("{}={}", name, word)];
      if (parameter.kind != config::Kind::boolean) continue;
      for (const char* const word : {"=true", "=false"}) to[name + word];
    }
  }
}

void addNamesInDaemon(const std::string& type, const CommandOptions& daemon, Candidates& to) {
  const auto* const list = std::ranges::find(kNameLists, type, &NameList::type);
  if (list == std::end(kNameLists)) return;
  const auto reply = callOnce(daemon, {list->method});
  if (!reply) return;
  for (const Json& item : reply->value(list->member, Json::array())) to[printable(textAt(item, "name"))];
}

/// A command line up to the word that is to be completed.
struct Typed {
  const CLI::App* command = nullptr;
  const CLI::Option* option = nullptr;  ///< the one that takes the word; null: none
  CommandOptions daemon;
};

Typed followed(const CLI::App& app, const std::vector<std::string>& words) {
  Typed typed{&app, nullptr, {}};
  for (const std::string& word : words) {
    if (typed.option != nullptr) {
      if (typed.option->check_lname("socket")) typed.daemon.socket = word;
      typed.option = nullptr;
    } else if (word.starts_with('-')) {
      const CLI::Option* option = optionOf(typed.command, word);
      if (option != nullptr && option->get_items_expected_max() > 0) typed.option = option;
    } else if (const CLI::App* command = commandFor(*typed.command, word)) {
      typed.command = command;
    }
  }
  return typed;
}

void addValues(const CLI::Option& option, const std::string& last, const CommandLine& line,
               const Typed& typed, Candidates& to) {
  const std::string type = option.get_type_name();
  addWords(type, to);
  addNamesInDaemon(type, typed.daemon, to);
  if (type == "COMMAND") addCommands(line.app(), to);
  if (type == "PARAMETER=VALUE") addAssignments(last, to);
  if (type == "PARAMETER") {
    for (const config::Parameter& parameter : config::parameterTable()) to[std::string(parameter.name)];
  }
  if (type == "FILE" || type == "PATH" || type == "FOLDER" || type == "NAME|FILE") to[kFiles];
}

Candidates candidatesFor(const CommandLine& line, const Typed& typed, const std::string& last) {
  Candidates candidates;
  if (typed.option != nullptr) {
    addValues(*typed.option, last, line, typed, candidates);
  } else if (last.starts_with('-')) {
    addOptions(line.app(), candidates);
    addOptions(*typed.command, candidates);
  } else {
    addCommands(*typed.command, candidates);
    const auto arguments =
        typed.command->get_options([](const CLI::Option* one) { return one->get_positional(); });
    if (!arguments.empty()) addValues(*arguments.front(), last, line, typed, candidates);
  }
  std::erase_if(candidates,
                [&](const auto& one) { return one.first != kFiles && !one.first.starts_with(last); });
  return candidates;
}

/// bash takes '=' for a word of its own.
std::vector<std::string> joinedAtEquals(const std::vector<std::string>& words) {
  std::vector<std::string> joined;
  bool goes_on = false;
  for (const std::string& word : words) {
    if (!joined.empty() && (goes_on || word == "=")) {
      joined.back() += word;
    } else {
      joined.push_back(word);
    }
    goes_on = word == "=";
  }
  return joined;
}

constexpr std::string_view kBashScript =
    R"sh(# bash completion of hapticctl. Load it with: source <(hapticctl completion bash)
_hapticctl() {
  local line current="${COMP_WORDS[COMP_CWORD]}"
  COMPREPLY=()
  while IFS= read -r line; do
    if [[ "$line" == :files ]]; then
      compopt -o filenames 2>/dev/null
      mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$current")
    else
      COMPREPLY+=("${line%%$'\t'*}")
    fi
  done < <(hapticctl __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
  if [[ "$current" == = || "${COMP_WORDS[COMP_CWORD-1]}" == = ]]; then
    COMPREPLY=("${COMPREPLY[@]#*=}") # bash completes what stands behind the '='
  elif [[ "${COMPREPLY[0]-}" == *= ]]; then
    compopt -o nospace 2>/dev/null
  fi
}
complete -F _hapticctl hapticctl
)sh";

constexpr std::string_view kZshScript = R"sh(#compdef hapticctl
# zsh completion of hapticctl. Load it with: source <(hapticctl completion zsh)
_hapticctl() {
  local line
  local -a assignments candidates
  for line in "${(@f)$(hapticctl __complete "${(@)words[2,CURRENT-1]}" "$PREFIX" 2>/dev/null)}"; do
    case "$line" in
      (:files) _files ;;
      (*=) assignments+=("$line") ;;
      (?*) line="${line//:/\\:}"; candidates+=("${line/$'\t'/:}") ;;
    esac
  done
  compadd -S '' -- $assignments
  _describe hapticctl candidates
}
# zsh calls this file as a function when it finds it in fpath
if [[ "${funcstack[1]}" == _hapticctl ]]; then
  _hapticctl "$@"
elif (( $+functions[compdef] )); then
  compdef _hapticctl hapticctl
fi
)sh";

constexpr std::string_view kFishScript =
    R"sh(# fish completion of hapticctl. Load it with: hapticctl completion fish | source
function __hapticctl_complete
  set -l typed (commandline -opc)
  set -l current (commandline -ct)
  set -e typed[1]
  for line in (hapticctl __complete $typed "$current" 2>/dev/null)
    if test "$line" = :files
      __fish_complete_path "$current"
    else
      echo $line
    end
  end
end
complete -c hapticctl -f -a '(__hapticctl_complete)'
)sh";

}  // namespace

int printCandidates(const CommandLine& line, const std::vector<std::string>& words) {
  std::vector<std::string> before = joinedAtEquals(words);
  const std::string last = before.empty() ? "" : before.back();
  if (!before.empty()) before.pop_back();
  const Typed typed = followed(line.app(), before);
  if (const HelpedCommand* const command = line.helped(*typed.command)) return line.runHelper(*command);
  for (auto [word, help] : candidatesFor(line, typed, last)) {
    std::ranges::replace(help, '\n', ' ');
    fmt::print("{}{}{}\n", word, help.empty() ? "" : "\t", help);
  }
  return kOk;
}

void addCompletionCommand(CommandLine& line) {
  const auto shell = std::make_shared<std::string>();
  const CommandOptions& options = line.options();
  line.add("completion", "Print the completion script of a shell: source <(hapticctl completion bash)",
           [&options, shell] {
             const std::string_view script = *shell == "zsh"    ? kZshScript
                                             : *shell == "fish" ? kFishScript
                                                                : kBashScript;
             if (options.json) {
               printJson({{"shell", *shell}, {"script", script}});
             } else {
               fmt::print("{}", script);
             }
             return static_cast<int>(kOk);
           })
      .add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace hapticd::tools
