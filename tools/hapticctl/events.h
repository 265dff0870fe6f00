// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/calls.h"

namespace hapticd::tools {

struct EventOptions {
  bool follow = false;             ///< go on with what happens from now on
  int count = 20;                  ///< most past events to show
  std::vector<std::string> kinds;  ///< empty: all
};

/// Prints what has happened, a line for each event; returns the exit code.
int runEvents(const CommandOptions& options, const EventOptions& events);

/// "2026-03-04 05:06:07.123" in the caller's time zone; "-" for NaN. `realtime_ns`: CLOCK_REALTIME.
std::string localTime(double realtime_ns);

/// "2026-03-04 05:06:07 UTC", as names of traces have it; "-" for NaN.
std::string utcTime(double realtime_ns);

}  // namespace hapticd::tools
