// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/program.h"

namespace hapticd::test {

/// The root of the installation that ctest has staged, for the prefix /usr.
inline std::filesystem::path stagedRoot() {
  const std::filesystem::path root = HAPTICD_STAGED_FOLDER;
  EXPECT_TRUE(std::filesystem::exists(root))
      << "run these tests by ctest, which stages the installation first";
  return root;
}

/// The files below `root`, relative to it and sorted.
inline std::vector<std::string> filesBelow(const std::filesystem::path& root) {
  std::vector<std::string> files;
  for (const std::filesystem::directory_entry& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(root).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Path of a program of this machine, or empty.
inline std::string programPath(const std::string& name) {
  for (const char* folder : {"/usr/bin", "/bin", "/usr/sbin", "/sbin", "/usr/local/bin"}) {
    const std::filesystem::path path = std::filesystem::path(folder) / name;
    if (::access(path.c_str(), X_OK) == 0) return path;
  }
  return {};
}

/// Runs a program of this machine with these arguments.
inline Finished runTool(const std::string& name, const std::vector<std::string>& arguments,
                        const std::vector<std::string>& environment = {}) {
  std::vector<std::string> command{"/usr/bin/env", name};  // some tools are scripts that ask for their path
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runToEnd(command, {.environment = environment});
}

/// The value of the last line `key=value` of a unit file; empty where there is none.
inline std::string unitSetting(const std::string& unit_text, const std::string& key) {
  std::string value;
  std::istringstream lines(unit_text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(key + "=")) value = line.substr(key.size() + 1);
  }
  return value;
}

}  // namespace hapticd::test

/// Ends the test where `program` is not installed.
#define HAPTICD_NEEDS(program) \
  if (::hapticd::test::programPath(program).empty()) GTEST_SKIP() << program << " is not installed here"
