// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <functional>
#include <sstream>
#include <string>
#include <string_view>

namespace hapticd::config {

/// Runs `work` as the whole of a program and returns its exit status. If the status is 0, everything that
/// `work` printed on standard output has been written. Where it could not be written (a full disk, a device
/// that is gone), the reason goes to standard error and the status is 1, unless `work` failed with another
/// status. A reader that closed its end of a pipe has seen enough: that is no error. A file that grows beyond
/// the limit of setrlimit() is an error of the write, not a signal. If a standard stream was closed at the
/// start, no file or socket that `work` opens takes its descriptor. name: of the program, printed in front of
/// the reason.  Thread: main.
int runProgram(std::string_view name, const std::function<int()>& work);

/// Flushes standard output; false if this or an earlier write failed. Programs that print for a long time end
/// then, and runProgram() reports the reason.  Thread: main.
bool flushOutput();

/// Prints a wrong command line's error in the form that all programs share: the program's name, what is
/// wrong, and where to read on. command: the program's name, and the subcommand that was being read.
inline void printUsageError(std::string_view command, std::string_view what) {
  const std::string program(command.substr(0, command.find(' ')));
  const std::string text = program + ": " + std::string(what) + "\nRun '" + std::string(command) +
                           " --help' for more information.\n";
  std::fputs(text.c_str(), stderr);
}

/// The program's name and the subcommands that were read so far: "hapticctl trace list". `app` is CLI11's.
template <typename App>
std::string commandPath(const App& app) {
  std::string path = app.get_name();
  path.erase(0, path.rfind('/') + 1);  // CLI11 takes the whole path of the program for its name
  for (const App* command = &app; !command->get_subcommands().empty();) {
    command = command->get_subcommands().front();
    path += " " + command->get_name();
  }
  return path;
}

/// Prints what a command line asks for instead of work (--help, --version), or why it is refused. `app` and
/// `error` are CLI11's; CLI11 itself would print into C++ streams, whose failures give no reason. Returns the
/// exit status: 0, or `usage_status` where the command line is refused.
template <typename App, typename ParseError>
int endWithoutWork(const App& app, const ParseError& error, int usage_status) {
  std::ostringstream output, errors;
  const bool asked_for = app.exit(error, output, errors) == 0;
  std::fputs(output.str().c_str(), stdout);
  if (!asked_for) printUsageError(commandPath(app), error.what());
  return asked_for ? 0 : usage_status;
}

}  // namespace hapticd::config
