// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/haptic-soak/soak_run.h"

namespace hapticd::tools {

struct SoakLimits {
  bool strict = false;  ///< late and left-out ticks count too: for a machine with real time
  std::optional<double> memory_growth_kb;  ///< beyond the noise; nothing: allowedGrowth_kb()
  std::optional<double> memory_kb;         ///< in use at any time; nothing: no limit
};

/// A counted or measured value with its limit.
struct SoakFinding {
  std::string what;
  std::optional<double> value;  ///< nothing: not known
  std::optional<double> limit;  ///< the most that is allowed; nothing: only reported

  /// Whether the limit is violated; it is if the value is not known.
  bool broken() const { return limit && !(value && *value <= *limit); }
};

/// Returns everything that was lost, failed or grew, with its limit.
std::vector<SoakFinding> findingsOf(const SoakResult& result, const SoakLimits& limits);

/// Returns a report for people: resources of the process over time, statistics of the clients, findings.
std::string soakTable(const SoakResult& result, const std::vector<SoakFinding>& findings);

/// Returns the report as JSON.
std::string soakJson(const SoakResult& result, const std::vector<SoakFinding>& findings);

}  // namespace hapticd::tools
