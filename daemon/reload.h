// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::daemon {

/// What changes when the configuration file is read again.
struct Reload {
  /// A live parameter whose value changes.
  struct Change {
    std::string_view name;
    std::string old_value;
    std::string new_value;
  };

  config::Settings
      settings;  ///< the current ones, with the live parameters, fixtures and regions of the file
  std::vector<Change> changes;  ///< in the order of the parameter table
  std::vector<std::string_view>
      waiting;  ///< parameters that differ in the file, but only take effect at the next start
};

/// Compares the settings in use (`running`) with those of the file (`loaded`). All live parameters, fixtures
/// and tissue regions take the file's values, including those that a client has set in the meantime.
/// Errors: the file's live parameters contradict parameters that only a restart can change.
std::expected<Reload, std::vector<config::Error>> reloaded(const config::Settings& running,
                                                           const config::Settings& loaded);

}  // namespace hapticd::daemon
