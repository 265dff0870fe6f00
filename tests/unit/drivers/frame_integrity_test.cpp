// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/frame_integrity.h"

#include <gtest/gtest.h>

namespace hapticd::drivers {
namespace {

// Log lines as written by libfreenect 0.5.3.

TEST(FrameIntegrity, AcceptsAFrameWithAllItsPackets) {
  FrameIntegrity integrity;
  integrity.noteLogLine("Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00002a10\n");
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, AcceptsAFrameWithoutLogLines) {
  FrameIntegrity integrity;
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, RejectsTheFrameThatLostPacketsAndOnlyThatOne) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 3 packets\n");
  integrity.noteLogLine("[Stream 70] Lost 3 total packets in 7 frames (0.428571 lppf)\n");
  integrity.noteLogLine("Got depth frame of size 422400/422400, 239/242 packets arrived, TS 00002a10\n");
  EXPECT_EQ(integrity.takeDamage(), "239 of 242 packets arrived");
  integrity.noteLogLine("Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00002a10\n");
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, RejectsBothFramesWhenPacketsAreLostAcrossTheirBoundary) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 4 packets\n");
  integrity.noteLogLine("Got depth frame of size 422400/422400, 240/242 packets arrived, TS 00002a10\n");
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
  integrity.noteLogLine("Got depth frame of size 422400/422400, 240/242 packets arrived, TS 00002a10\n");
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, RejectsALossAlsoWithoutThePacketCount) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 1 packets\n");
  EXPECT_EQ(integrity.takeDamage(), "Lost 1 packets");
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, RejectsAFrameWithAShortPacketThoughAllPacketsArrived) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Expected 1748 data bytes, but got 900\n");
  integrity.noteLogLine("Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00002a10\n");
  EXPECT_EQ(integrity.takeDamage(), "Expected 1748 data bytes, but got 900");
}

TEST(FrameIntegrity, AcceptsTheFrameAfterAnAbandonedOne) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 60 packets\n");
  integrity.noteLogLine("[Stream 70] Lost too many packets, resyncing...\n");
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

TEST(FrameIntegrity, IgnoresTheColourStream) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 80] Lost 3 packets\n");
  EXPECT_EQ(integrity.takeDamage(), std::nullopt);
}

}  // namespace
}  // namespace hapticd::drivers
