// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device_check/person.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace hapticd::tools {

void PersonAtTerminal::say(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

bool PersonAtTerminal::isReady(const std::string& request) {
  fmt::print("\n{} Then press Enter, or q and Enter to give up.\n", request);
  const auto line = answerLine();
  return line && *line != "q";
}

std::optional<bool> PersonAtTerminal::answer(const std::string& question) {
  while (true) {
    fmt::print("{} (y/n, or q to give up) ", question);
    const auto line = answerLine();
    if (!line || *line == "q") return std::nullopt;
    if (*line == "y") return true;
    if (*line == "n") return false;
  }
}

std::optional<std::string> PersonAtTerminal::answerLine() const {
  constexpr int kLook_ms = 100;
  std::fflush(stdout);
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (::poll(&input, 1, kLook_ms) <= 0) {
    if (interrupt_.requested()) return std::nullopt;
  }
  std::string line;
  return std::getline(std::cin, line) ? std::optional(line) : std::nullopt;
}

}  // namespace hapticd::tools
