// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <expected>
#include <string>
#include <vector>

namespace hapticd::tools {

/// The commands of a group, in the order in which help lists them.
std::vector<const CLI::App*> commandsOf(const CLI::App& group);

/// The commands of a group that a word may stand for: the one of that name, else all whose names begin with
/// it.
std::vector<const CLI::App*> commandsFor(const CLI::App& group, const std::string& word);

/// The command of a group that has the word as its name, or as the beginning of its name and no other's; null
/// if there is none.
const CLI::App* commandFor(const CLI::App& group, const std::string& word);

/// The option of the command, or of those around it; null if there is none. name: with its dashes.
const CLI::Option* optionOf(const CLI::App* command, const std::string& name);

/// Whether a command may be called by the beginning of its name: if it changes nothing that acts on the hand,
/// and deletes nothing. `path`: its names without the program's, such as "trace list". Every command that is
/// not listed needs its full name.
bool mayBeShortened(const std::string& path);

/// Why a word is no command's name.
struct WrongWord {
  std::string path;  ///< the group where the command was looked for: "hapticctl trace"
  std::string what;  ///< in a whole sentence, with the commands that it could be
};

/// Why no command of a group is named by a word: with those that it could be, or was probably meant to be.
/// path: the names of the group with the program's.
WrongWord wrongWord(const CLI::App& app, const CLI::App& group, const std::string& path,
                    const std::string& word);

/// Replaces the beginnings of names by the names, as `ip` of iproute2 takes them: "tr li" becomes "trace
/// list". words: of the command line, without the program's name; options stay as they are.
/// Errors: a word that begins the name of several commands or of none, or one that shortens the name of a
/// command that needs its full name.
std::expected<std::vector<std::string>, WrongWord> withFullNames(const CLI::App& app,
                                                                 std::vector<std::string> words);

}  // namespace hapticd::tools
