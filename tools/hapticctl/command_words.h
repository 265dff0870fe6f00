// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace hapticd::tools {

/// What a shell can offer for the value of an option or for an argument. Profiles and traces are those of the
/// daemon.
struct Takes {
  enum class Kind {
    nothing,
    anything,
    files,
    words,
    parameters,
    assignments,
    profiles,
    fixtures,
    regions,
    traces,
    traces_or_files
  };
  Kind kind = Kind::nothing;
  std::vector<std::string> words;
};

struct OptionWord {
  std::string name;  ///< such as "--interval" or "-n"
  std::string help;
  Takes takes;
};

/// A command, a group of commands, or the program itself.
struct CommandWords {
  std::string path;  ///< "trace start"; empty for the program
  std::string help;
  std::vector<std::string> subcommands;
  std::vector<OptionWord> options;  ///< without those of the commands around it
  Takes argument;                   ///< the first one
};

/// The program and all its commands, each group before its commands.
std::vector<CommandWords> commandWordsOf(const CLI::App& app);

}  // namespace hapticd::tools
