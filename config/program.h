// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <functional>
#include <sstream>
#include <string_view>

namespace hapticd::config {

/// Runs `work` as the whole of a program and returns its exit status. What `work` prints on standard output
/// has arrived when the status is 0: where it could not be written (a full disk, a device that is gone) the
/// reason goes to standard error and the status is 1, unless `work` has failed with another one. A reader
/// that has closed its end of a pipe wants no more: that is no error. A file beyond the limit of setrlimit()
/// is an error of the write, not a signal. No file or socket that `work` opens takes the place of a standard
/// stream that was closed. name: of the program, in front of the reason.  Thread: main.
int runProgram(std::string_view name, const std::function<int()>& work);

/// Writes out what was printed on standard output; false when it, or something before it, did not arrive.
/// Programs that print for a long time end then, and runProgram() says why.  Thread: main.
bool flushOutput();

/// Prints what a command line asks for instead of work (--help, --version), or why it is refused. `app` and
/// `error` are CLI11's; it would print into streams of its own, whose failures say no reason. Returns the
/// exit status: 0, or `usage_status` where the command line is refused.
template <typename App, typename ParseError>
int endWithoutWork(const App& app, const ParseError& error, int usage_status) {
  std::ostringstream output, errors;
  const bool asked_for = app.exit(error, output, errors) == 0;
  std::fputs(output.str().c_str(), stdout);
  std::fputs(errors.str().c_str(), stderr);
  return asked_for ? 0 : usage_status;
}

}  // namespace hapticd::config
