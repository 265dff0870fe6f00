// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/stability/stability_study.h"

namespace hapticd::tools {

/// All that the bench found.
struct StabilityResults {
  std::vector<LoopLimit> limits;
  std::vector<DefaultRun> defaults;
  std::vector<RegionPoint> region;
};

/// Why a limit is not where the theory has it, from what was measured; empty where it is within 10 %, and
/// beginning with "NOT explained" where neither the felt stiffness nor friction (the same loop without it,
/// which is looked up in `limits`, being within 10 %) accounts for it.
std::string explanationOf(const LoopLimit& limit, const std::vector<LoopLimit>& limits);

/// The tables for people.
std::string stabilityTable(const StabilityResults& results);

/// The same for programs, as JSON.
std::string stabilityJson(const StabilityResults& results);

}  // namespace hapticd::tools
