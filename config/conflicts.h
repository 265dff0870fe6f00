// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"

namespace hapticd::config {

/// A violated rule between parameters whose individual values are all in range.
struct Conflict {
  /// Names of the parameters that the rule involves, the most likely cause first.
  std::vector<std::string_view> parameters;
  base::Error error;  ///< where: the first parameter
};

/// Adds a violated rule; the first of its parameters is the place of the error.
void addConflict(std::vector<Conflict>& conflicts, std::vector<std::string_view> parameters, std::string what,
                 std::string remedy);

/// Returns every violated rule, or none.
std::vector<Conflict> conflictsIn(const Settings& settings);

}  // namespace hapticd::config
