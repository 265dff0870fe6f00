// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/server_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "config/value_text.h"

namespace hapticd::tools::view {

void ServerLog::write(const std::string& line) {
  // a reader that is gone is no reason to end
  std::fputs(("hapticd-view: " + config::printable(line) + "\n").c_str(), stderr);
}

void ServerLog::refuse(const std::string& who, const std::string& reason) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  allowed_ = std::min<double>(kMostAtOnce, allowed_ + seconds * kMostPerSecond);
  if (allowed_ < 1) {
    ++left_out_;
    return;
  }
  allowed_ -= 1;
  std::string line = fmt::format("refused {}: {}", who, reason);
  if (left_out_ > 0) line += fmt::format(" (and {} more before it)", std::exchange(left_out_, 0));
  write(line);
}

}  // namespace hapticd::tools::view
