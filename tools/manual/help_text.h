// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// An option or subcommand and what it does.
struct HelpEntry {
  std::string name;  ///< "-c,--config FILE REQUIRED", "watch"
  std::string text;
};

/// The output of a program for --help.
struct HelpText {
  std::string usage;  ///< "hapticctl watch [OPTIONS]", without the program's folder
  std::vector<HelpEntry> arguments;
  std::vector<HelpEntry> options;
  std::vector<HelpEntry> commands;
  std::vector<HelpEntry> exit_statuses;  ///< "0", "done"
};

/// Parses the output of CLI11: two blanks before an entry, its text from the 31st column on or, where
/// the name is long, in the lines below. Unknown parts are skipped.
HelpText parseHelp(std::string_view printed);

}  // namespace hapticd::tools
