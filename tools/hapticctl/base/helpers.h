// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::tools {

/// A command that works on files or devices. Another program does it, a helper, which hapticctl executes with
/// the words that it was given.
struct HelpedCommand {
  std::string_view path;  ///< "trace info"
  const char* helper;     ///< name of the program, in the folder of the helpers
  const char* help;       ///< null: the command states it itself
};

/// The row of a command, by its path without the program's name; null: hapticctl does it itself.
const HelpedCommand* helpedCommand(std::string_view path);

/// Replaces this program by a helper with these arguments; returns only if that fails. arguments: of main().
/// The helpers are in a folder beside that of this program, in a build as where it is installed.
base::Error executeHelper(const HelpedCommand& command, char** arguments);

}  // namespace hapticd::tools
