// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/base/calls.h"

namespace hapticd::tools {

struct EventOptions {
  bool follow = false;             ///< go on with new events
  int count = 20;                  ///< the number of past events to show at most
  std::vector<std::string> kinds;  ///< empty: all
};

/// Prints past events, and with `follow` new ones until Ctrl-C, a line each. While it follows it survives a
/// restart of the daemon: it connects again, and reports that on standard error. Returns the exit code.
int runEvents(const CommandOptions& options, const EventOptions& events);

}  // namespace hapticd::tools
