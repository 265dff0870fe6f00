// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "config/parameter_table.h"
#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// What an error says of the parameter that is named beside it.
std::string reasonOf(const config::Error& error);

/// The type `Parameter` of io.hapticd.Status with its value in `settings`.
OrderedJson parameterJson(const config::Parameter& parameter, const config::Settings& settings);

/// `changes` (names and values, an object) applied to `settings`, which take effect at once.
/// Errors: a reply io.hapticd.Control.InvalidValue with all problems, or RestartRequired when it is only
/// that.
std::expected<config::Settings, Reply> changedSettings(const config::Settings& settings, const Json& changes);

}  // namespace hapticd::daemon
