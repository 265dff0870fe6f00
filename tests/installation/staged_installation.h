// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/program.h"

#include "tests/support/file_content.h"

namespace hapticd::test {

/// The root of the installation that ctest has staged, for the prefix /usr.
std::filesystem::path stagedRoot();

/// The files below `root`, relative to it and sorted.
std::vector<std::string> filesBelow(const std::filesystem::path& root);

/// Path of a program of this machine, or empty.
std::string programPath(const std::string& name);

/// Runs a program of this machine with these arguments.
Finished runTool(const std::string& name, const std::vector<std::string>& arguments,
                 const std::vector<std::string>& environment = {});

/// The value of the last line `key=value` of a unit file; empty where there is none.
std::string unitSetting(const std::string& unit_text, const std::string& key);

}  // namespace hapticd::test

/// Ends the test where `program` is not installed.
#define HAPTICD_NEEDS(program) \
  if (::hapticd::test::programPath(program).empty()) GTEST_SKIP() << program << " is not installed here"
