// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/program.h"

namespace hapticd::daemon::test {

struct ProcessResult {
  int exit_code = -1;  ///< -1: it did not exit by itself
  std::string output;
  std::string errors;
};

/// Runs a program to its end; `command` is its path and arguments.
inline ProcessResult runProcess(const std::vector<std::string>& command,
                                const hapticd::test::ProgramOptions& options = {}) {
  const hapticd::test::Finished finished = hapticd::test::runToEnd(command, options);
  return {finished.ending.exited ? finished.ending.code : -1, finished.output, finished.errors};
}

}  // namespace hapticd::daemon::test
