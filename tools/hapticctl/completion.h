// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// The completion script of a shell ("bash", "zsh" or "fish") for a command line of one or two levels of
/// subcommands: their names, options, and what the options and arguments take, all from `app` and the
/// parameter table. The option's type determines what it takes: FILE, PATH and FOLDER, PARAMETER,
/// PARAMETER=VALUE, or the words that it is checked for.
std::string completionScript(std::string_view shell, const CLI::App& app);

}  // namespace hapticd::tools
