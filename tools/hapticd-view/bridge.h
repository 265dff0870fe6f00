// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"

namespace hapticd::tools::view {

struct BridgeOptions {
  std::string socket = config::Settings().control.status_socket;
  std::string listen = "127.0.0.1:8765";  ///< unused where the service manager passes sockets
  std::vector<std::string> hosts = {};
  std::vector<std::string> origins = {};
  std::string page = {};
  std::string token = {};  ///< empty: none is needed
  std::optional<double> idle_exit_s = {};
  std::string version = {};
};

struct BridgeFailure {
  base::Error error;
  int status = 0;  ///< of the program, sysexits.h
};

/// Serves until SIGTERM, SIGINT or the idle time has passed. Prints the address it listens at.
/// Thread: main.
std::optional<BridgeFailure> runBridge(const BridgeOptions& options);

}  // namespace hapticd::tools::view
