// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The exit status of hapticctl.
enum ExitCode {
  kOk = 0,
  kFailed = 1,  ///< refused by the daemon, or failed
  kUsage = 2,
  kNoConnection = 3,
};

/// The error and what to do about it, in one or more lines.
std::string errorText(const ClientError& error);

/// Prints the error on stderr; with `json` as an object, which contains an error reply as it was received.
/// Returns the exit code for the error.
int report(const ClientError& error, bool json);

/// Prints what is wrong with a command line on stderr, and how to get help; with `json` as an object of the
/// same form as other errors, whose name is "WrongUsage". command: the program's name, and the commands that
/// were read. Returns the exit code.
int reportUsage(const std::string& command, const std::string& what, bool json);

/// Reports an error of this program, such as a file that cannot be written.
int report(const base::Error& error, bool json);
/// Reports several at once; with `json` as one object, with all of them in its parameters.
int report(const std::vector<base::Error>& errors, bool json);

}  // namespace hapticd::tools
