// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/haptic-soak/soak_report.h"
#include "tools/haptic-soak/soak_run.h"
#include "tools/lib/child/interrupt.h"

namespace hapticd::tools {

struct FloodOptions {
  SoakOptions soak;  ///< daemon, hapticctl, configuration, assignments and time
  int connections = 40;
  double max_gap_s = 0.5;        ///< longest wait of the watchdog
  double max_disengage_s = 0.1;  ///< longest run of hapticctl disengage
};

struct FloodResult {
  std::vector<double> disengage_s;  ///< hapticctl disengage, from its start to its end
  std::uint64_t failed = 0;         ///< of them, with another exit status than 0
  bool flooded = false;             ///< to the end
  Json status;                      ///< GetStatus at the end
  std::string status_error;         ///< why there is no `status`
};

/// Measures one daemon whose status socket is flooded by another user while this one disengages again and
/// again. Errors: hapticd does not start.
config::Result<FloodResult> studyFlood(const FloodOptions& options, const Interrupt& interrupt,
                                       const std::function<void(double)>& progress);

/// Returns the measured values with their limits.
std::vector<SoakFinding> findingsOf(const FloodResult& result, const FloodOptions& options);

/// Returns the result as a table for people.
std::string floodTable(const FloodResult& result, const std::vector<SoakFinding>& findings);
/// Returns the result as JSON.
std::string floodJson(const FloodResult& result, const std::vector<SoakFinding>& findings);

}  // namespace hapticd::tools
