// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::daemon::test {

struct ProcessResult {
  int exit_code = -1;  ///< -1: it did not exit by itself
  std::string output;
  std::string errors;
};

struct ProcessOptions {
  std::vector<std::string> environment = {};  ///< "NAME=value"; nothing else but PATH is in it
  unsigned uid = 0;                           ///< not 0: the user to run it as, which takes root
  bool terminal = false;                      ///< stdout is a terminal
  std::string interrupt_after = {};           ///< not empty: SIGINT once that text has been printed
};

/// Runs a program to its end; `command` is its path and arguments.
ProcessResult runProcess(const std::vector<std::string>& command, const ProcessOptions& options = {});

}  // namespace hapticd::daemon::test
