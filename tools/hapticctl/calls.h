// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "config/error.h"
#include "tools/client/varlink_client.h"

namespace hapticd::tools {

/// What holds for every command.
struct CommandOptions {
  bool json = false;
  std::string socket;          ///< empty: the environment's, else the default ones
  std::string color = "auto";  ///< auto, always, never
};

/// One call to the daemon.
struct Call {
  std::string method;  ///< with its interface
  Json parameters = Json::object();
  /// It changes something or waits for the disk, for which only the control socket serves.
  bool may_change = false;
  std::chrono::milliseconds limit = VarlinkClient::kTimeLimit;
};

/// The default control socket, and the status socket where that one will not do.
/// `may_change`: the command changes something, for which only the control socket serves.
ClientResult<VarlinkClient> connectTo(const CommandOptions& options, bool may_change);

/// The reply's parameters.
ClientResult<Json> callOnce(const CommandOptions& options, const Call& call);

/// A document as `--json` shows it.
void printJson(const Json& document);

/// A document in one line, for streams.
void printJsonLine(const Json& document);

/// Calls once and prints the reply: as JSON, or what `text` makes of it. Returns the exit code.
int callAndPrint(const CommandOptions& options, const Call& call,
                 const std::function<std::string(const Json& reply)>& text);

}  // namespace hapticd::tools
