// SPDX-License-Identifier: Apache-2.0
// Faults of the emulated camera on command, and other commands.

#include <gtest/gtest.h>

#include <cerrno>

#include "tests/vm/emulators/tests/kinect_rig.h"

namespace hapticd::test {
namespace {

TEST_F(EmulatedKinect, LeavesCommandsUnansweredWhileMuteUntilTheyAreTakenBack) {
  rig_.tell("mute");
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).status, 0) << "not a command of the camera";
  const std::uint32_t request = rig_.host().submitIn(0xc0, 0, 0, 0x200);
  rig_.serve();
  rig_.advance(1'000'000'000);
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.host().unlink(request);
  rig_.serve();
  EXPECT_EQ(rig_.host().next().status, -ECONNRESET);
  rig_.tell("resume");
  EXPECT_EQ(rig_.in(0xc0, 0, 0, 0x200).status, 0);
}

TEST_F(EmulatedKinect, AnswersNothingAtTheControlEndpointWhenAllIsMute) {
  rig_.tell("mute all");
  rig_.host().submitIn(0x80, 8, 0, 1);
  rig_.host().submitIn(0xc0, 0, 0, 0x200);
  rig_.serve();
  rig_.advance(1'000'000'000);
  EXPECT_TRUE(rig_.host().hasNothing());
  EXPECT_EQ(rig_.connection().pending(), 2U);
}

TEST_F(EmulatedKinect, CompletesNoUrbWhileStalledAndLosesNoDataByThat) {
  rig_.startDepth();
  rig_.tell("stall");
  rig_.host().submitIso(0x82, kPackets);
  rig_.serve();
  rig_.advance(10 * kUrb_ns);
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.tell("resume");
  rig_.serve();
  rig_.advance(kUrb_ns);
  EXPECT_EQ(rig_.host().next().packets.front().at(3), 0x71);
}

TEST_F(EmulatedKinect, LosesTheGivenNumberOfPacketsOfEachFrameUntilToldOff) {
  rig_.startDepth();
  rig_.tell("lose 3");
  for (int frame = 0; frame < 2; ++frame) {
    const std::vector<Bytes> packets = rig_.framePackets();
    ASSERT_EQ(packets.size(), 239U);
    const auto sequence = static_cast<std::uint8_t>(packets[99][5] + 4);
    EXPECT_EQ(packets[100][5], sequence) << "visible in the sequence number";
  }
  rig_.tell("lose off");
  EXPECT_EQ(rig_.framePackets().size(), 242U);
  EXPECT_NE(rig_.device().status().find("\"lost_packets\":6,"), std::string::npos) << rig_.device().status();
}

TEST_F(EmulatedKinect, LosesPacketsOfOneFrameOnly) {
  rig_.startDepth();
  rig_.tell("lose 5 once");
  EXPECT_EQ(rig_.framePackets().size(), 237U);
  EXPECT_EQ(rig_.framePackets().size(), 242U);
}

TEST_F(EmulatedKinect, ShortensOnePacketOfEachFrame) {
  rig_.startDepth();
  rig_.tell("short");
  std::size_t wrong = 0;
  for (const Bytes& packet : rig_.framePackets()) wrong += packet.size() != 1760 && packet.size() != 1144;
  EXPECT_EQ(wrong, 1U);
}

TEST_F(EmulatedKinect, SpoilsAHeaderNowAndThenAndEverySecondTimeKeepsTheMagic) {
  rig_.startDepth();
  rig_.tell("garbage");
  std::size_t wrong_magic = 0, wrong_flag = 0, packets = 0;
  for (int frame = 0; frame < 20; ++frame) {
    for (const Bytes& packet : rig_.packetsOfOnePeriod()) {
      const bool magic = packet[0] == 'R' && packet[1] == 'B';
      const bool flag = packet[3] == 0x71 || packet[3] == 0x72 || packet[3] == 0x75;
      ++packets;
      wrong_magic += !magic;
      wrong_flag += magic && !flag;
    }
  }
  const std::size_t spoiled = packets / 401;
  EXPECT_EQ(wrong_magic, (spoiled + 1) / 2);
  EXPECT_GE(wrong_flag, spoiled / 2 - 1) << "a random byte is seldom a right one";
  EXPECT_NE(rig_.device().status().find("\"garbage_packets\":" + std::to_string(spoiled) + ","),
            std::string::npos)
      << rig_.device().status();
}

TEST_F(EmulatedKinect, RepeatsAFrozenFrameAndPlaysOnFromIt) {
  rig_.startDepth();
  rig_.tell("freeze 2");
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 2));
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 2));
  rig_.tell("play");
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 2));
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame));
}

TEST_F(EmulatedKinect, WaitsForAHostThatIsLateAndCountsIt) {
  rig_.startDepth();
  rig_.packets(1);
  rig_.advance(5 * kUrb_ns);
  EXPECT_NE(rig_.device().status().find("\"starved\":1"), std::string::npos) << rig_.device().status();
  EXPECT_EQ(rig_.packets(1).front().at(5), 16) << "the sequence goes on";
}

TEST_F(EmulatedKinect, CountsTheFramesSinceDepthWasStarted) {
  rig_.startDepth();
  rig_.image();
  rig_.image();
  EXPECT_TRUE(rig_.device().status().starts_with("\"streaming\":true,\"frames\":2,\"frame_index\":1,"))
      << rig_.device().status();
}

TEST_F(EmulatedKinect, RefusesCommandsThatMakeNoSense) {
  for (const std::string_view line : {"", "fly", "lose", "lose -1", "lose 243", "lose 1 twice", "lose once",
                                      "freeze", "freeze 3", "freeze x"}) {
    EXPECT_TRUE(rig_.device().command(line).starts_with("error: ")) << line;
  }
  EXPECT_NE(rig_.device().command("lose 243").find("0 to 242"), std::string::npos);
  EXPECT_NE(rig_.device().command("freeze 3").find("0 to 2"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::test
