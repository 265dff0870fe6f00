// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tools/hapticctl/calls.h"

namespace hapticd::tools {

/// The kinds of events of a daemon of this version, as io.hapticd.Status names them.
inline constexpr std::array kEventKinds{"mode",      "camera",      "handle",        "warning", "engage",
                                        "disengage", "clear_fault", "parameter",     "profile", "calibration",
                                        "trace",     "mark",        "configuration", "reload",  "stop"};

struct EventOptions {
  bool follow = false;             ///< go on with new events
  int count = 20;                  ///< the number of past events to show at most
  std::vector<std::string> kinds;  ///< empty: all
};

/// Prints past events, and with `follow` new ones until Ctrl-C, a line each. While it follows it survives a
/// restart of the daemon: it connects again, and says so on standard error. Returns the exit code.
int runEvents(const CommandOptions& options, const EventOptions& events);

}  // namespace hapticd::tools
