// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "tools/hapticctl/terminal_text.h"

namespace hapticd::tools {

ProgressLine::ProgressLine(std::string doing)
    : doing_(std::move(doing)), terminal_(isScreen(STDERR_FILENO)) {}

void ProgressLine::show(double share) {
  const int percent = static_cast<int>(100 * share);
  if (!terminal_ || percent == shown_percent_) return;
  shown_percent_ = percent;
  fmt::print(stderr, "\r{} {} %\033[K", doing_, percent);
  std::fflush(stderr);
}

void ProgressLine::end() {
  if (shown_percent_ < 0) return;
  shown_percent_ = -1;
  fmt::print(stderr, "\r\033[K");
}

}  // namespace hapticd::tools
