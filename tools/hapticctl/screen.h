// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::tools {

/// Uses the alternate screen of the terminal, with a hidden cursor, while the object lives. It writes the
/// ANSI sequences of xterm, which all common terminals understand. stdout must be a terminal.
class Screen {
 public:
  Screen() { enter(); }
  ~Screen() { leave(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Replaces the shown lines without clearing the screen first, which would flicker. False if the terminal
  /// is gone.
  bool show(const std::vector<std::string>& lines);
  /// Gives the terminal back while the program is stopped (Ctrl-Z), and takes it again.
  void stop();

 private:
  void enter();
  void leave();
};

}  // namespace hapticd::tools
