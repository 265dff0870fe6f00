// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/yaml_loader.h"

namespace hapticd::config {

/// What a configuration makes of the defaults, for people who check whether all that they wrote has arrived.
struct SettingsSummary {
  std::size_t set = 0;                   ///< parameters that the file and the overrides name
  std::vector<std::string> differences;  ///< "safety.max_force_n = 1 (default 4)", in the table's order

  /// The first of them, joined, and how many there are beyond these; empty: none differs.
  std::string differencesText() const;
  /// "12 parameters set, 3 differ from the defaults: safety.max_force_n = 1 (default 4), ...".
  std::string text() const;
};

SettingsSummary summaryOf(const Configuration& configuration);

}  // namespace hapticd::config
