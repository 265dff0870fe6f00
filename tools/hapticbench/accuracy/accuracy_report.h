// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/requirement.h"

namespace hapticd::tools {

/// All scenes and distances of one law, setting and noise as one row each, in the order of the laws.
std::vector<AccuracyRow> summaryOf(const std::vector<AccuracyRow>& rows);

/// Checks the requirements on the laws with `rows`.
std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows);

/// The rows, their summary and the requirements, for people and for programs.
std::string accuracyText(const std::vector<AccuracyRow>& rows);
std::string accuracyJson(const std::vector<AccuracyRow>& rows);

}  // namespace hapticd::tools
