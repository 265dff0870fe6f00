// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/error.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Adds an option for each member of a fixture, named like it with dashes ("--radius-m"), and --points-file.
/// What is given becomes a member of `members`, with the type that it has in the configuration.
/// Errors, as CLI::ValidationError: not a number, not a list of numbers.
void addFixtureMembers(CLI::App& command, const std::shared_ptr<Json>& members);
/// The same for the members that a touch with the handle does not measure.
void addTouchedFixtureMembers(CLI::App& command, const std::shared_ptr<Json>& members);
/// The same for regions.
void addRegionMembers(CLI::App& command, const std::shared_ptr<Json>& members);

/// Reads points from a text: three numbers on each line, separated by blanks or commas; '#' begins a comment.
/// `name`: of the file. Errors: a line that holds something else, with its number.
config::Result<Json> pointsFromText(const std::string& text, const std::string& name);

}  // namespace hapticd::tools
