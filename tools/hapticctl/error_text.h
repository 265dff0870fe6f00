// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/error.h"
#include "tools/client/varlink_client.h"

namespace hapticd::tools {

/// What hapticctl exits with.
enum ExitCode {
  kOk = 0,
  kFailed = 1,  ///< refused by the daemon, or failed
  kUsage = 2,
  kNoConnection = 3,
};

/// The error in plain words and what to do about it, one or more lines.
std::string errorText(const ClientError& error);

/// Prints the error on stderr, with `json` as an object that holds an error reply as it came; returns the
/// exit code that it stands for.
int report(const ClientError& error, bool json);

/// The same for what failed without the daemon, a file or a computation.
int report(const config::Error& error, bool json);

}  // namespace hapticd::tools
