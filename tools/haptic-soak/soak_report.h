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

/// One thing that was counted.
struct SoakFinding {
  std::string what;
  std::optional<double> value;  ///< nothing: not known
  std::optional<double> limit;  ///< the most that is allowed; nothing: only reported

  /// A limit on what is not known is broken.
  bool broken() const { return limit && !(value && *value <= *limit); }
};

/// Everything lost, failed and grown, with its limit.
std::vector<SoakFinding> findingsOf(const SoakResult& result, const SoakLimits& limits);

/// For people: what the process held over time, what the clients did, the findings.
std::string soakTable(const SoakResult& result, const std::vector<SoakFinding>& findings);

/// The same for programs.
std::string soakJson(const SoakResult& result, const std::vector<SoakFinding>& findings);

}  // namespace hapticd::tools
