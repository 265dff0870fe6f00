// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/command_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "config/base/value_text.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

using base::printable;
using Commands = std::vector<const CLI::App*>;

/// The commands that only show something, or write files and traces of which none is replaced unasked.
/// `disengage` is not among them, although it ends all force: a hand that is held or guided is let go, and a
/// fault is cleared, which nobody may do by a slip of the finger.
constexpr std::array<std::string_view, 36> kShortened{
    "status",       "watch",         "events",        "metrics",      "version",      "get",
    "params",       "snapshot",      "view",          "doctor",       "completion",   "help",
    "camera list",  "camera test",   "handle list",   "trace start",  "trace stop",   "trace dump",
    "trace mark",   "trace list",    "trace keep",    "trace note",   "trace info",   "trace breaches",
    "trace export", "trace recover", "trace plot",    "fixture list", "fixture show", "fixture export",
    "region list",  "region show",   "region export", "frame list",   "frame show",   "ros"};

/// What the others do, where it is not the force that they can change.
struct Reason {
  std::string_view path;
  std::string_view text;
};
constexpr std::array kReasons{Reason{"trace delete", "which deletes traces"},
                              Reason{"save", "which writes a profile"}};

std::string reasonFor(const std::string& path) {
  const auto* const found = std::ranges::find(kReasons, path, &Reason::path);
  return std::string(found == kReasons.end() ? "which can act on the force" : found->text);
}

/// "save, set or status".
std::string anyOf(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  }
  return text;
}

/// "; 'hapticctl fixture list' and 'hapticctl trace list' are commands" where the word names a command of
/// another group, as in "hapticctl list fixture".
std::string elsewhere(const CLI::App& app, const CLI::App& group, const std::string& word) {
  std::vector<std::string> found;
  for (const CLI::App* one : commandsOf(app)) {
    if (one == &group) continue;
    for (const CLI::App* below : commandsOf(*one)) {
      if (below->get_name() == word) found.push_back(fmt::format("'{} {}'", one->get_name(), word));
    }
  }
  for (const CLI::App* one : commandsOf(app)) {
    if (&group != &app && one->get_name() == word) found.push_back(fmt::format("'{}'", word));
  }
  return found.empty() ? "" : fmt::format(" (did you mean {}?)", anyOf(found));
}

std::string path(const std::string& before, const std::string& word) {
  return before.empty() || word.empty() ? before + word : before + " " + word;
}

}  // namespace

Commands commandsOf(const CLI::App& group) {
  return group.get_subcommands([](const CLI::App*) { return true; });
}

Commands commandsFor(const CLI::App& group, const std::string& word) {
  Commands beginning;
  for (const CLI::App* command : commandsOf(group)) {
    if (command->get_name() == word) return {command};
    if (!word.empty() && command->get_name().starts_with(word)) beginning.push_back(command);
  }
  return beginning;
}

const CLI::App* commandFor(const CLI::App& group, const std::string& word) {
  const Commands commands = commandsFor(group, word);
  return commands.size() == 1 ? commands.front() : nullptr;
}

const CLI::Option* optionOf(const CLI::App* command, const std::string& name) {
  for (; command != nullptr; command = command->get_parent()) {
    if (const CLI::Option* option = command->get_option_no_throw(name)) return option;
  }
  return nullptr;
}

bool mayBeShortened(const std::string& path) {
  return std::ranges::find(kShortened, path) != kShortened.end();
}

WrongWord wrongWord(const CLI::App& app, const CLI::App& group, const std::string& path,
                    const std::string& word) {
  std::vector<std::string> candidates;
  for (const CLI::App* command : commandsFor(group, word)) candidates.push_back(command->get_name());
  if (!candidates.empty()) {
    return {path, fmt::format("'{}' could be {}: write more of it", printable(word), anyOf(candidates))};
  }
  std::vector<std::string_view> names;
  for (const CLI::App* command : commandsOf(group)) names.push_back(command->get_name());
  const std::string meant = base::didYouMean(word, names);
  return {path, fmt::format("there is no command '{} {}'{}", path, printable(word),
                            meant.empty() ? elsewhere(app, group, word) : " (" + meant + ")")};
}

std::expected<std::vector<std::string>, WrongWord> withFullNames(const CLI::App& app,
                                                                 std::vector<std::string> words) {
  const CLI::App* command = &app;
  std::string typed, full;  // "tr li", "trace list"
  for (std::size_t i = 0; i < words.size() && !commandsOf(*command).empty(); ++i) {
    std::string& word = words[i];
    if (word.starts_with('-')) {
      const CLI::Option* const option = optionOf(command, word.substr(0, word.find('=')));
      if (option == nullptr) return words;  // the parser names it
      if (option->get_items_expected_max() > 0 && word.find('=') == std::string::npos) ++i;
      continue;
    }
    const CLI::App* const next = commandFor(*command, word);
    if (next == nullptr) return std::unexpected(wrongWord(app, *command, path("hapticctl", full), word));
    typed = path(typed, word);
    full = path(full, next->get_name());
    word = next->get_name();
    command = next;
  }
  if (typed != full && commandsOf(*command).empty() && !mayBeShortened(full)) {
    return std::unexpected(WrongWord{
        "hapticctl " + full,
        fmt::format("'{}' could be '{}', {}: write it in full", printable(typed), full, reasonFor(full))});
  }
  return words;
}

}  // namespace hapticd::tools
