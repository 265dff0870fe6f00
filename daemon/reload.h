// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::daemon {

/// What a configuration that was read again asks for.
struct Reload {
  config::Settings
      settings;  ///< the current ones, with the live parameters, fixtures and regions of the file
  std::vector<std::string_view>
      waiting;  ///< parameters that differ in the file, but only take effect at the next start
  /// "fixture nerve": what the file defines and what is not in use, because a client or a profile has given
  /// the name to another one.
  std::vector<std::string> hidden;
};

/// Compares the settings in use (`running`) with those of the file (`loaded`). All live parameters take the
/// file's values, including those that a client has set in the meantime. Of the fixtures and regions only
/// those of the configuration change: they become what the file says, also where a client has changed or
/// removed them, and those that it no longer has go; what profiles and clients have added stays.
/// Errors: the file's live parameters contradict parameters that only a restart can change, or there would be
/// more fixtures or regions than are possible.
std::expected<Reload, std::vector<config::Error>> reloaded(const config::Settings& running,
                                                           const config::Settings& loaded);

}  // namespace hapticd::daemon
