// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/screen.h"

#include <fmt/format.h>
#include <signal.h>

#include "config/program.h"

namespace hapticd::tools {

bool Screen::show(const std::vector<std::string>& lines) {
  std::string text = "\033[H";
  // cleared before it is written: after a line that fills the terminal the cursor is still on its last
  // column
  for (std::size_t i = 0; i < lines.size(); ++i) text += (i == 0 ? "\033[K" : "\r\n\033[K") + lines[i];
  fmt::print("{}\033[J", text);
  return config::flushOutput();
}

void Screen::stop() {
  leave();
  ::raise(SIGSTOP);
  enter();
}

void Screen::enter() {
  fmt::print("\033[?1049h\033[?25l\033[2J");
  config::flushOutput();
}

void Screen::leave() {
  fmt::print("\033[?25h\033[?1049l");
  config::flushOutput();
}

}  // namespace hapticd::tools
