// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::tools {

/// The terminal's other screen, without a cursor, while the object lives; plain ANSI sequences, as xterm and
/// all that follow it know them. stdout must be a terminal.
class Screen {
 public:
  Screen() { enter(); }
  ~Screen() { leave(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Writes over what is shown, without the flicker of clearing it first. False when the terminal is gone.
  bool show(const std::vector<std::string>& lines);
  /// Gives the terminal back while the program is stopped, and takes it again.
  void stop();

 private:
  void enter();
  void leave();
};

}  // namespace hapticd::tools
