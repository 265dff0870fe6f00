// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "config/parameter_table.h"
#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// The text of an error without the name of its parameter, which has a field of its own.
std::string reasonOf(const config::Error& error);

/// A parameter as the type `Parameter` of io.hapticd.Status, with its value in `settings`.
OrderedJson parameterJson(const config::Parameter& parameter, const config::Settings& settings);

/// Returns `settings` with `changes` (an object of names and values of live parameters) applied.
/// Errors: a reply io.hapticd.Control.InvalidValue with all problems, or RestartRequired if the only problem
/// is that parameters are not live.
std::expected<config::Settings, Reply> changedSettings(const config::Settings& settings, const Json& changes);

}  // namespace hapticd::daemon
