// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/frame_integrity.h"

#include <cstdio>
#include <utility>

namespace hapticd::drivers {
namespace {

constexpr std::string_view kDepthStream = "[Stream 70] ";

std::string_view withoutLineEnd(std::string_view line) {
  while (line.ends_with('\n') || line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace

void FrameIntegrity::noteLogLine(std::string_view line) {
  line = withoutLineEnd(line);
  if (line.starts_with("Got depth frame")) {
    int arrived = 0;
    int expected = 0;
    const std::string text(line);
    if (std::sscanf(text.c_str(), "Got depth frame of size %*d/%*d, %d/%d", &arrived, &expected) == 2) {
      count_ = std::to_string(arrived) + " of " + std::to_string(expected) + " packets arrived";
      count_is_complete_ = arrived == expected;
    }
    return;
  }
  if (!line.starts_with(kDepthStream)) return;
  line.remove_prefix(kDepthStream.size());
  if (line.find("esync") != std::string_view::npos) {
    loss_.clear();  // libfreenect abandons the frame in progress and restarts
  } else if (line.starts_with("Expected") || (line.starts_with("Lost") && line.ends_with("packets"))) {
    loss_ = line;
  }
}

std::optional<std::string> FrameIntegrity::takeDamage() {
  const std::string count = std::exchange(count_, {});
  const bool short_packet = loss_.starts_with("Expected");
  if (!count.empty() && !count_is_complete_) {
    if (!short_packet) loss_.clear();  // a short packet may already belong to the frame after the lost ones
    return count;
  }
  const std::string loss = std::exchange(loss_, {});
  if (loss.empty() || (!count.empty() && !short_packet)) return std::nullopt;
  return loss;
}

}  // namespace hapticd::drivers
