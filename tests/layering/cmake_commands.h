// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::test {

/// One command of a CMakeLists.txt. Arguments are split at everything that cannot be in the name of a target,
/// so that those inside of generator expressions are found too.
struct CMakeCommand {
  int line = 0;  ///< 1 for the first
  std::string name;
  std::vector<std::string> arguments;
};

/// All commands of a text, those inside of functions and conditions too.
std::vector<CMakeCommand> cmakeCommands(std::string_view text);

}  // namespace hapticd::test
