// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/support/program.h"

namespace hapticd::test {

/// A program whose stdout and stderr are a terminal of its own; killed with the object. All that it prints is
/// kept.
class TerminalProgram {
 public:
  TerminalProgram(const std::vector<std::string>& command, const std::vector<std::string>& environment,
                  int rows, int columns);
  ~TerminalProgram();
  TerminalProgram(const TerminalProgram&) = delete;
  TerminalProgram& operator=(const TerminalProgram&) = delete;

  /// Waits until it has printed that; false when it does not in time.
  bool prints(const std::string& text);
  /// Changes the terminal's size, of which SIGWINCH notifies the program.
  void resize(int rows, int columns);
  /// Presses a key, such as Ctrl-C ('\3').
  void press(char key);
  void signal(int number);
  /// Closes the terminal, as when a connection breaks.
  void hangUp();
  /// Waits for its end.
  Ending wait();
  const std::string& output();

 private:
  void readAll();

  pid_t pid_ = -1;
  int terminal_ = -1;
  std::string output_;
};

}  // namespace hapticd::test
