// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "config/base/error.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The options that hold for every command.
struct CommandOptions {
  bool json = false;
  std::string socket;          ///< empty: the one of the environment, else the default ones
  std::string color = "auto";  ///< auto, always, never
};

/// One call to the daemon.
struct Call {
  std::string method;  ///< with its interface
  Json parameters = Json::object();
  /// It changes something or waits for the disk, which only the control socket offers.
  bool may_change = false;
  std::chrono::milliseconds limit = VarlinkClient::kTimeLimit;
};

/// Connects to the socket that is named, or to the default control socket, or, where that does not open and a
/// command only reads, to the status socket. `may_change`: the command changes something, which only the
/// control socket offers.
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
