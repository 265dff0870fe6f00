#pragma once

#include <string>

#include "tools/hapticctl/varlink_client.h"

namespace hapticd::tools {

/// What hapticctl exits with.
enum ExitCode {
  kOk = 0,
  kErrorReply = 1,
  kUsage = 2,
  kNoConnection = 3,
};

/// The error in plain words and what to do about it, one or more lines.
std::string errorText(const ClientError& error);

/// Prints the error on stderr, with `json` an error reply as it came; returns the exit code that it stands
/// for.
int report(const ClientError& error, bool json);

}  // namespace hapticd::tools
