// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {

/// A shell in the folder of a daemon, which runs the commands of transcripts. All programs are on its PATH,
/// and hapticctl calls the daemon on the socket there. `until_says TEXT COMMAND` repeats a command until it
/// prints the text.
class Shell {
 public:
  explicit Shell(const DaemonHome& home) : home_(home) {}

  /// Runs a command: its standard output, the lines of standard error behind "2> ", and "[STATUS]" unless
  /// that is 0. Paths are relative to the folder; TIME stands for the time in the name of a trace.
  std::string answer(const std::string& command) const;
  Finished run(const std::string& command) const;

 private:
  const DaemonHome& home_;
};

}  // namespace hapticd::test
