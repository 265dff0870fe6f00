#include "tools/hapticctl/completion.h"

#include <fmt/format.h>

#include <array>

#include "config/parameter_table.h"

namespace hapticd::tools {
namespace {

struct Word {
  std::string_view word;
  std::string_view help;
};

constexpr std::array<Word, 9> kCommands{{
    {"status", "the whole state"},
    {"watch", "the state, again and again"},
    {"get", "values of parameters"},
    {"set", "change parameters"},
    {"engage", "command force"},
    {"disengage", "end all force"},
    {"params", "the table of parameters"},
    {"doctor", "what is wrong with this machine"},
    {"completion", "completion script of a shell"},
}};

constexpr std::string_view kOptions = "--json --socket --help --version";

std::string commandNames() {
  std::string names;
  for (const Word& command : kCommands) names += fmt::format("{}{}", names.empty() ? "" : " ", command.word);
  return names;
}

/// Names separated by blanks, with `suffix` behind each.
std::string parameterNames(bool live_only, std::string_view suffix) {
  std::string names;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (live_only && parameter.effect != config::Effect::live) continue;
    names += fmt::format("{}{}{}", names.empty() ? "" : " ", parameter.name, suffix);
  }
  return names;
}

std::string wordsOf(const config::Parameter& parameter) {
  if (parameter.kind == config::Kind::boolean) return "true false";
  std::string words;
  for (const std::string_view choice : parameter.choices)
    words += fmt::format("{}{}", words.empty() ? "" : " ", choice);
  return words;
}

/// For each live parameter that takes words, `line` with its name and them.
std::string choiceLines(const char* line) {
  std::string lines;
  for (const config::Parameter& parameter : config::parameterTable()) {
    const std::string words = wordsOf(parameter);
    if (parameter.effect == config::Effect::live && !words.empty()) {
      lines += fmt::format(fmt::runtime(line), fmt::arg("name", parameter.name), fmt::arg("words", words));
    }
  }
  return lines;
}

std::string bashScript() {
  return fmt::format(
      R"sh(# bash completion of hapticctl. Load it with: source <(hapticctl completion bash)
_hapticctl_values() {{
  case "$1" in
{values}    *) ;;
  esac
}}
_hapticctl() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD-1]}}" command="" index
  COMPREPLY=()
  for ((index = 1; index < COMP_CWORD; index++)); do
    case "${{COMP_WORDS[index]}}" in
      --socket) ((index++)) ;;
      -*) ;;
      *) command="${{COMP_WORDS[index]}}"; break ;;
    esac
  done
  if [[ "$previous" == "--socket" || "$previous" == "--root" ]]; then
    COMPREPLY=($(compgen -f -- "$current"))
  elif [[ "$current" == -* ]]; then
    local options="{options}"
    [[ "$command" == watch ]] && options="$options --interval --count --seconds --line --summary"
    [[ "$command" == doctor ]] && options="$options --root"
    [[ "$command" == engage ]] && options="$options --inside"
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  elif [[ -z "$command" ]]; then
    COMPREPLY=($(compgen -W "{commands}" -- "$current"))
  elif [[ "$command" == get ]]; then
    COMPREPLY=($(compgen -W "{names}" -- "$current"))
  elif [[ "$command" == completion ]]; then
    COMPREPLY=($(compgen -W "bash zsh fish" -- "$current"))
  elif [[ "$command" == set ]]; then
    # bash makes '=' a word of its own.
    if [[ "$current" == "=" ]]; then
      COMPREPLY=($(compgen -W "$(_hapticctl_values "$previous")" -- ""))
    elif [[ "$previous" == "=" ]]; then
      COMPREPLY=($(compgen -W "$(_hapticctl_values "${{COMP_WORDS[COMP_CWORD-2]}}")" -- "$current"))
    else
      COMPREPLY=($(compgen -W "{assignments}" -- "$current"))
      compopt -o nospace 2>/dev/null
    fi
  fi
}}
complete -F _hapticctl hapticctl
)sh",
      fmt::arg("values", choiceLines("    {name}) echo \"{words}\" ;;\n")), fmt::arg("options", kOptions),
      fmt::arg("commands", commandNames()), fmt::arg("names", parameterNames(false, "")),
      fmt::arg("assignments", parameterNames(true, "=")));
}

std::string zshScript() {
  std::string commands;
  for (const Word& command : kCommands) commands += fmt::format("    '{}:{}'\n", command.word, command.help);
  return fmt::format(
      R"sh(#compdef hapticctl
# zsh completion of hapticctl. Load it with: source <(hapticctl completion zsh)
_hapticctl() {{
  local -a commands
  commands=(
{commands}  )
  local line state
  _arguments -C '--json[JSON output]' '--socket[socket of the daemon]:socket:_files' '--help[help]' \
    '--version[version]' '1:command:->command' '*::argument:->argument'
  case "$state" in
    command) _describe command commands ;;
    argument)
      case "$line[1]" in
        get) compadd -- {names} ;;
        completion) compadd -- bash zsh fish ;;
        watch) _arguments '--interval[milliseconds]:milliseconds' '--count[how many]:number' '--seconds[how long]:number' '--line[one short line]' '--summary[close with a summary]' ;;
        engage) _arguments '--inside[also where something is felt at once]' ;;
        doctor) _arguments '--root[folder that stands for the machine]:folder:_files -/' ;;
        set)
          case "$PREFIX" in
{values}            *) compadd -S '' -- {assignments} ;;
          esac ;;
      esac ;;
  esac
}}
# zsh calls the file itself, as a function, when it finds it in fpath
if [[ "${{funcstack[1]}}" == _hapticctl ]]; then
  _hapticctl "$@"
elif (( $+functions[compdef] )); then
  compdef _hapticctl hapticctl
fi
)sh",
      fmt::arg("commands", commands), fmt::arg("names", parameterNames(false, "")),
      fmt::arg("values", choiceLines("            {name}=*) compset -P '*='; compadd -- {words} ;;\n")),
      fmt::arg("assignments", parameterNames(true, "=")));
}

std::string fishScript() {
  std::string script =
      "# fish completion of hapticctl. Load it with: hapticctl completion fish | source\n"
      "complete -c hapticctl -f\n"
      "complete -c hapticctl -l json -d 'JSON output'\n"
      "complete -c hapticctl -l socket -r -F -d 'socket of the daemon'\n"
      "complete -c hapticctl -l help -d help\n"
      "complete -c hapticctl -l version -d version\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from watch' -l interval -x -d milliseconds\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from watch' -l count -x -d 'how many'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from watch' -l seconds -x -d 'how long'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from watch' -l line -d 'one short line'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from watch' -l summary -d 'close with a summary'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from engage' -l inside -d 'also where something is "
      "felt'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from doctor' -l root -r -F -d 'folder for the "
      "machine'\n"
      "complete -c hapticctl -n '__fish_seen_subcommand_from completion' -a 'bash zsh fish'\n";
  for (const Word& command : kCommands) {
    script += fmt::format("complete -c hapticctl -n __fish_use_subcommand -a {} -d '{}'\n", command.word,
                          command.help);
  }
  script += fmt::format("complete -c hapticctl -n '__fish_seen_subcommand_from get' -a '{}'\n",
                        parameterNames(false, ""));
  script += fmt::format("complete -c hapticctl -n '__fish_seen_subcommand_from set' -a '{}'\n",
                        parameterNames(true, "="));
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.effect != config::Effect::live) continue;
    const std::string words = wordsOf(parameter);
    for (std::size_t begin = 0; begin < words.size();) {
      const std::size_t end = std::min(words.find(' ', begin), words.size());
      script += fmt::format("complete -c hapticctl -n '__fish_seen_subcommand_from set' -a '{}={}'\n",
                            parameter.name, words.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  return script;
}

}  // namespace

std::string completionScript(std::string_view shell) {
  if (shell == "zsh") return zshScript();
  return shell == "fish" ? fishScript() : bashScript();
}

}  // namespace hapticd::tools
