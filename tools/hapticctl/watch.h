// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/calls.h"

namespace hapticd::tools {

struct WatchOptions {
  int interval_ms = 200;
  int count = 0;                    ///< end after that many states; 0: no end
  int seconds = 0;                  ///< end after that time; 0: no end
  bool line = false;                ///< one line that is written over, instead of the table
  bool summary = false;             ///< print a summary at the end, also after Ctrl-C
  std::vector<std::string> fields;  ///< of the status, for JSON; empty: all
};

/// Prints the state again and again until Ctrl-C or the end that `watch` sets: on a terminal as a table or a
/// line that is updated in place, else line by line. It survives a restart of the daemon: it connects again,
/// and reports that on standard error. The terminal is as before at the end, whatever ends it. Returns the
/// exit code.
int runWatch(const CommandOptions& options, const WatchOptions& watch);

}  // namespace hapticd::tools
