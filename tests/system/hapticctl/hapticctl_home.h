// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A folder with the socket that hapticctl is pointed to.
class HapticctlHome {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  std::filesystem::path socket() const { return path() / "Control"; }
  const TemporaryFolder& folder() const { return folder_; }

  std::vector<std::string> command(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {HAPTICCTL_PROGRAM, "--socket", socket().string()});
    return arguments;
  }
  Finished run(const std::vector<std::string>& arguments, const ProgramOptions& options = {}) const {
    return runToEnd(command(arguments), options);
  }

 private:
  TemporaryFolder folder_;
};

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace hapticd::test
