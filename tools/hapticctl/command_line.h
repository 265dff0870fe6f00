// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "tools/hapticctl/calls.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {

/// What a subcommand does; returns the exit code.
using Action = std::function<int()>;

/// What hapticctl can be asked for on the command line.
class CommandLine {
 public:
  CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// A subcommand of hapticctl.
  CLI::App& add(const std::string& name, const std::string& help, Action action);
  /// A subcommand that only has subcommands of its own.
  CLI::App& addGroup(const std::string& name, const std::string& help);
  /// A subcommand of a group.
  CLI::App& add(CLI::App& group, const std::string& name, const std::string& help, Action action);

  /// Valid while the command line lives; filled in by run().
  const CommandOptions& options() const { return options_; }
  const CLI::App& app() const { return app_; }

  /// Parses the arguments and does what they say; returns the exit code.
  int run(int argc, char** argv);

 private:
  CLI::App app_;
  CommandOptions options_;
  Action action_;
};

/// --force, for a subcommand that writes files.
void addForce(CLI::App& command, IfExists& if_exists);

/// --names, for a subcommand that lists what has names.
CLI::Option* addNames(CLI::App& command, bool& names_only);

// Each theme's subcommands, with their options and what they do.
void addStateCommands(CommandLine& line);      ///< status, watch, events, metrics, version
void addControlCommands(CommandLine& line);    ///< get, set, params, engage, disengage, clear-fault
void addProfileCommands(CommandLine& line);    ///< save, load, profiles
void addTraceCommands(CommandLine& line);      ///< trace ...
void addSnapshotCommand(CommandLine& line);    ///< snapshot
void addRegisterCommand(CommandLine& line);    ///< register
void addDoctorCommand(CommandLine& line);      ///< doctor
void addCompletionCommand(CommandLine& line);  ///< completion

}  // namespace hapticd::tools
