// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <functional>
#include <sstream>
#include <string>
#include <string_view>

namespace hapticd::base {

/// Runs `work` as the body of a program and returns its exit status. If the status is 0, everything that
/// `work` printed to standard output has been written: if it could not be (a full disk, a lost device), the
/// reason goes to standard error and the status is 1, unless `work` has failed with another one. A reader
/// that has closed its end of a pipe is not an error. Exceeding the limit of setrlimit() on the file size is
/// a write error, not a signal. No file or socket opened by `work` takes the descriptor of a standard stream
/// that was closed. Where memory ends, that is said and the status is 1. `name`: of the program, printed
/// before the reason.  Thread: main.
int runProgram(std::string_view name, const std::function<int()>& work);

/// Writes to standard output; an error is reported when the program ends, with its cause also where the text
/// is longer than the stream's buffer.
void writeOutput(std::string_view text);

/// Flushes standard output; returns false if this or an earlier write failed. Programs that print for a long
/// time end then, and runProgram() prints the reason.  Thread: main.
bool flushOutput();

/// Prints a wrong command line's error in the form that all programs share: the program's name, what is
/// wrong, and how to get help. `command`: the program's name, and the subcommand that was being read.
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

/// Prints what a command line requests instead of work (--help, --version), or why it is rejected. `app` and
/// `error` are CLI11's, which would print to streams of its own that do not report the reason of a failure.
/// Returns the exit status: 0, or `usage_status` if the command line is rejected.
template <typename App, typename ParseError>
int endWithoutWork(const App& app, const ParseError& error, int usage_status) {
  std::ostringstream output, errors;
  const bool asked_for = app.exit(error, output, errors) == 0;
  writeOutput(output.str());
  if (!asked_for) printUsageError(commandPath(app), error.what());
  return asked_for ? 0 : usage_status;
}

}  // namespace hapticd::base
