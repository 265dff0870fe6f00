// SPDX-License-Identifier: Apache-2.0
#include "tests/installation/staged_installation.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <sstream>

namespace hapticd::test {

namespace fs = std::filesystem;

fs::path stagedRoot() {
  const fs::path root = HAPTICD_STAGED_FOLDER;
  EXPECT_TRUE(fs::exists(root)) << "run these tests by ctest, which stages the installation first";
  return root;
}

std::vector<std::string> filesBelow(const fs::path& root) {
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(root).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string programPath(const std::string& name) {
  for (const char* folder : {"/usr/bin", "/bin", "/usr/sbin", "/sbin", "/usr/local/bin"}) {
    const fs::path path = fs::path(folder) / name;
    if (::access(path.c_str(), X_OK) == 0) return path;
  }
  return {};
}

Finished runTool(const std::string& name, const std::vector<std::string>& arguments,
                 const std::vector<std::string>& environment) {
  std::vector<std::string> command{"/usr/bin/env", name};  // some tools are scripts that ask for their path
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runToEnd(command, {.environment = environment});
}

std::string unitSetting(const std::string& unit_text, const std::string& key) {
  std::string value;
  std::istringstream lines(unit_text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(key + "=")) value = line.substr(key.size() + 1);
  }
  return value;
}

}  // namespace hapticd::test
