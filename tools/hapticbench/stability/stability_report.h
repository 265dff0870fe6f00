// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/stability/stability_study.h"

namespace hapticd::tools {

/// Everything that the study measured.
struct StabilityResults {
  std::vector<LoopLimit> limits;
  std::vector<DefaultRun> defaults;
};

/// Why a limit differs from the theory, by measurement; empty where it is within 10 %, and beginning with
/// "NOT explained" where neither the effective stiffness nor friction (the same loop without it, which is
/// looked up in `limits`, being within 10 %) accounts for it.
std::string explanationOf(const LoopLimit& limit, const std::vector<LoopLimit>& limits);

/// The limits and the loops with the shipped settings, for people and for programs.
std::string stabilityText(const StabilityResults& results);
std::string stabilityJson(const StabilityResults& results);

}  // namespace hapticd::tools
