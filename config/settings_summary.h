// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/yaml_loader.h"

namespace hapticd::config {

/// Summary of a configuration's differences from the defaults, so that people can check that all their
/// settings took effect.
struct SettingsSummary {
  std::size_t set = 0;  ///< number of parameters set by the file and the overrides
  std::size_t fixtures = 0;
  std::size_t regions = 0;
  std::vector<std::string> differences;  ///< e.g. "safety.max_force_n = 1 (default 4)", in the table's order

  /// Returns the first of them, joined, and the number of the others; empty if none differs.
  std::string differencesText() const;
  /// Returns e.g. "12 parameters set, 3 differ from the defaults: safety.max_force_n = 1 (default 4), ...".
  std::string text() const;
};

/// Summarises a loaded configuration.
SettingsSummary summaryOf(const Configuration& configuration);

/// Returns settings that are allowed but probably unintended; they are shown, never refused.
std::vector<base::Error> warningsOf(const Settings& settings);

}  // namespace hapticd::config
