// SPDX-License-Identifier: Apache-2.0
#include "realtime_setup_fixture.h"

#include <fstream>
#include <sstream>

namespace hapticd::test {

namespace fs = std::filesystem;

std::map<std::string, std::string> treeBelow(const fs::path& root) {
  std::map<std::string, std::string> tree;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    std::ostringstream text;
    if (entry.is_symlink()) {
      text << "link to " << fs::read_symlink(entry.path()).string();
    } else {
      text << std::oct << static_cast<unsigned>(entry.status().permissions()) << " ";
      if (entry.is_regular_file()) text << std::ifstream(entry.path()).rdbuf();
    }
    tree[entry.path().lexically_relative(root).string()] = text.str();
  }
  return tree;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Finished RealtimeSetupOn::run(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), {"/bin/bash", REALTIME_SETUP});
  arguments.insert(arguments.end(), {"--root", machine.root()});
  return runToEnd(arguments);
}

void RealtimeSetupOn::expectDone(const Finished& finished) const {
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.output << finished.errors;
  EXPECT_EQ(finished.errors, "");
}

void RealtimeSetupOn::expectRefusal(const Finished& finished, const std::string& reason) const {
  EXPECT_EQ(finished.ending, exitedWith(1)) << finished.output;
  EXPECT_NE(finished.errors.find(reason), std::string::npos) << finished.errors;
}

void RealtimeSetupOn::expectRevertRestoresAll() const {
  const auto before = treeBelow(machine.root());
  expectDone(run({"apply"}));
  EXPECT_NE(treeBelow(machine.root()), before);
  expectDone(run({"revert"}));
  EXPECT_EQ(treeBelow(machine.root()), before);
}

std::string RealtimeSetupOn::content(const std::string& path) const {
  std::ostringstream text;
  text << std::ifstream(machine.root() / path).rdbuf();
  return text.str();
}

std::string RealtimeSetupOn::settings(const std::string& path) const {
  std::istringstream lines(content(path));
  std::string all;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('#')) all += line + "\n";
  }
  return all;
}

}  // namespace hapticd::test
