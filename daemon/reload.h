// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::daemon {

/// What a configuration file that was read again changes.
struct Reload {
  /// A live parameter that gets another value.
  struct Change {
    std::string_view name;
    std::string old_value;
    std::string new_value;
  };

  config::Settings settings;              ///< the running ones with the file's live parameters
  std::vector<Change> changes;            ///< in the order of the parameter table
  std::vector<std::string_view> waiting;  ///< differ in the file, but take effect at the next start only
};

/// `running`: in force now; `loaded`: from the file. The live parameters follow the file, also those that a
/// client has set since. Errors: the file's live parameters contradict those that cannot change now.
std::expected<Reload, std::vector<config::Error>> reloaded(const config::Settings& running,
                                                           const config::Settings& loaded);

}  // namespace hapticd::daemon
