// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {

/// The tables for people: one per law, a summary, and what must hold.
std::string accuracyTable(const std::vector<AccuracyRow>& rows);

/// The same for programs, as JSON.
std::string accuracyJson(const std::vector<AccuracyRow>& rows);

}  // namespace hapticd::tools
