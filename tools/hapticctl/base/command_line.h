// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/base/whole_file.h"
#include "tools/hapticctl/base/calls.h"

namespace hapticd::tools {

/// A command that works on files or devices. Another program does it, a helper, which hapticctl executes with
/// the words that it was given.
struct HelpedCommand {
  std::string_view path;  ///< "trace info"
  const char* helper;     ///< name of the program, in the folder of the helpers
  const char* help;       ///< null: the command states it itself
};

/// The row of a command, by its path without the program's name; null: hapticctl does it itself.
const HelpedCommand* helpedCommand(std::string_view path);

/// Replaces this program by a helper with these arguments; returns only if that fails. arguments: of main().
/// The helpers are in a folder beside that of this program, in a build as where it is installed.
base::Error executeHelper(const HelpedCommand& command, char** arguments);

/// Prints the help of a command as CLI11 does, in lines of at most 80 columns: texts are wrapped, and the
/// words that an option accepts are listed in its text where they do not fit beside its name.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_footer(const CLI::App* command) const override;

 private:
  /// A name in the left column and its text, wrapped, in the right one.
  std::string row(const std::string& name, const std::string& text) const;
};

/// The work of a command; returns the exit code.
using Action = std::function<int()>;

/// The command line of hapticctl: its commands, and the options that hold for all of them.
class CommandLine {
 public:
  /// is_helper: of a program that hapticctl executes, and which has no other commands than those that it
  /// does.
  explicit CommandLine(bool is_helper = false);
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Adds a command of hapticctl.
  CLI::App& add(const std::string& name, const std::string& help, Action action);
  /// Adds a command that only holds commands of its own.
  CLI::App& addGroup(const std::string& name, const std::string& help);
  /// Adds a command of a group.
  CLI::App& add(CLI::App& group, const std::string& name, const std::string& help, Action action);
  /// Adds a command that a helper does, to the group that its path names. action: of the helper.
  CLI::App& addHelped(const std::string& path, Action action = {});
  /// The same for several commands.
  void addAllHelped(const std::vector<std::string>& paths);

  /// The options of all commands, filled in by run(); the reference is valid while the command line lives.
  const CommandOptions& options() const { return options_; }
  const CLI::App& app() const { return app_; }

  /// Parses the arguments, in which names of commands may be shortened (command_words.h), and runs the action
  /// of the command, or the helper that does it; returns the exit code.
  int run(int argc, char** argv);

  /// The row of a command, if a helper does it, or what this program does not know of it; null otherwise.
  const HelpedCommand* helped(const CLI::App& command) const;
  /// Gives the whole command line to a helper; returns the exit code if that fails.
  int runHelper(const HelpedCommand& command) const;

 private:
  CLI::App app_;
  CommandOptions options_;
  Action action_;
  bool is_helper_;
  char** arguments_ = nullptr;
};

/// The main function of hapticctl and of its helpers. add: adds the commands.
int runCommandLine(int argc, char** argv, bool is_helper, void (*add)(CommandLine& line));

/// Adds --force to a command that writes files, or other things that may exist.
void addForce(CLI::App& command, base::IfExists& if_exists, const char* help = "Replace files that exist");

/// Adds --names to a command that lists things with names.
CLI::Option* addNames(CLI::App& command, bool& names_only);

// Each function adds the commands of one theme, with their options and actions.
void addStateCommands(CommandLine& line);      ///< status, watch, events, metrics, version
void addControlCommands(CommandLine& line);    ///< get, set, params, engage, disengage, ...
void addProfileCommands(CommandLine& line);    ///< save, load, profiles
void addFixtureCommands(CommandLine& line);    ///< fixture ...
void addRegionCommands(CommandLine& line);     ///< region ...
void addFrameCommands(CommandLine& line);      ///< frame ...
void addTraceCommands(CommandLine& line);      ///< trace ...
void addSnapshotCommand(CommandLine& line);    ///< snapshot
void addViewCommand(CommandLine& line);        ///< view
void addRosCommand(CommandLine& line);         ///< ros
void addCompletionCommand(CommandLine& line);  ///< completion
void addHelpCommand(CommandLine& line);        ///< help

/// The hidden command `hapticctl __complete WORD...`, which the shells' completions call: prints what may
/// stand in place of the last of `typed`, the words behind `hapticctl` up to the cursor. One candidate a
/// line, behind it a tab and its help where it has one; `:files` stands for the names of files. Commands,
/// options and their words are those of `line`, parameters those of the parameter table, and what has a name
/// in the daemon is asked for. A candidate that ends with '=' is not followed by a blank. Returns the exit
/// code.
int printCandidates(const CommandLine& line, const std::vector<std::string>& typed);

}  // namespace hapticd::tools
