// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/frame_integrity.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace hapticd::drivers {
namespace {

using Damage = std::optional<std::string>;

/// Log lines of libfreenect 0.5.3 before a frame is delivered, and what they say of the frame.
struct Case {
  std::vector<const char*> lines;
  Damage damage;
};
constexpr const char* kAll = "Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00002a10\n";
constexpr const char* kSome = "Got depth frame of size 422400/422400, 240/242 packets arrived, TS 00002a10\n";

TEST(FrameIntegrity, IsWhatTheLogLinesBeforeAFrameSay) {
  const Case cases[] = {
      {{}, {}},
      {{kAll}, {}},
      {{"[Stream 70] Lost 2 packets\n", "[Stream 70] Lost 2 total packets in 7 frames (0.285714 lppf)\n",
        kSome},
       "240 of 242 packets arrived"},
      {{"[Stream 70] Lost 1 packets\n"}, "Lost 1 packets"},
      {{"[Stream 70] Expected 1748 data bytes, but got 900\n", kAll},
       "Expected 1748 data bytes, but got 900"},
      // the frame with the loss is abandoned, and the next one is delivered
      {{"[Stream 70] Lost 60 packets\n", "[Stream 70] Lost too many packets, resyncing...\n"}, {}},
      {{"[Stream 80] Lost 3 packets\n"}, {}}};  // the colour stream
  for (const auto& [lines, damage] : cases) {
    FrameIntegrity integrity;
    for (const char* line : lines) integrity.noteLogLine(line);
    EXPECT_EQ(integrity.takeDamage(), damage) << (lines.empty() ? "no line" : lines.front());
    EXPECT_EQ(integrity.takeDamage(), std::nullopt) << "of the next frame";
  }
}

TEST(FrameIntegrity, RejectsBothFramesWhenPacketsAreLostAcrossTheirBoundary) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 4 packets\n");
  integrity.noteLogLine(kSome);
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
  integrity.noteLogLine(kSome);
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
}

}  // namespace
}  // namespace hapticd::drivers
