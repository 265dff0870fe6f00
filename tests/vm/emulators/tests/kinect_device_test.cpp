// SPDX-License-Identifier: Apache-2.0
// The emulated camera as a kernel meets it. What its commands and packets hold is tried with the real
// libfreenect in tests/unit/drivers/freenect_camera_test.cpp, which shares them.

#include <gtest/gtest.h>

#include <cerrno>
#include <set>

#include "tests/vm/emulators/tests/kinect_rig.h"

namespace hapticd::test {
namespace {

TEST_F(EmulatedKinect, IsEnumeratedAndConfiguredAsTheCameraOfAModel1414) {
  EXPECT_EQ(rig_.in(0x80, 6, 0x0100, 64).data,
            (Bytes{18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x5e, 0x04, 0xae, 0x02, 0x0b, 0x01, 2, 1, 3, 1}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0200, 255).data, (Bytes{9, 2, 32,   0, 1,    1,    0,    0xc0, 8,  //
                                                       9, 4, 0,    0, 2,    0xff, 0xff, 0xff, 0,  //
                                                       7, 5, 0x81, 1, 0xc0, 0x0b, 1,              //
                                                       7, 5, 0x82, 1, 0xc0, 0x0b, 1}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0303, 255).data, (Bytes{6, 3, 'K', 0, '1', 0}));
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).data, Bytes{0});
  EXPECT_EQ(rig_.out(0x00, 9, 1).status, 0);
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).data, Bytes{1});
}

TEST_F(EmulatedKinect, StallsAtRequestsThatItDoesNotKnow) {
  EXPECT_EQ(rig_.in(0x80, 6, 0x0f00, 5).status, -EPIPE) << "BOS descriptor";
  EXPECT_EQ(rig_.out(0x00, 9, 2).status, -EPIPE) << "configuration 2";
  EXPECT_EQ(rig_.in(0xc0, 0x10, 0, 1).status, -EPIPE) << "of the motor";
}

TEST_F(EmulatedKinect, UnderstandsRequestsThatArriveInPieces) {
  // GET_CONFIGURATION: request 1 of device 1-2, IN, endpoint 0
  const Bytes request{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 2, 0, 0, 0, 1, 0,    0, 0, 0, 0, 0, 0, 0,
                      0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 8, 0, 0, 0, 0, 1, 0};
  for (const std::uint8_t byte : request) {
    EXPECT_EQ(rig_.counts().completed, 0U);
    rig_.host().send({byte});
    rig_.serve();
  }
  EXPECT_EQ(rig_.counts().completed, 1U);
  rig_.host().send(Bytes(48, 0xee));
  rig_.serve();
  EXPECT_FALSE(rig_.connection().isAlive()) << "nonsense ends it";
}

TEST_F(EmulatedKinect, CompletesUrbsWithEmptyPacketsEachTwoMillisecondsBeforeDepthIsStarted) {
  const std::uint32_t first = rig_.host().submitIso(0x82, kPackets);
  const std::uint32_t second = rig_.host().submitIso(0x82, kPackets);
  rig_.serve();
  rig_.advance(kUrb_ns - 1);
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.advance(1);
  const KernelSide::Reply reply = rig_.host().next();
  EXPECT_EQ(reply.sequence, first);
  EXPECT_EQ(reply.actual_length, 0U);
  EXPECT_EQ(reply.packets.size(), kPackets);
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.advance(kUrb_ns);
  EXPECT_EQ(rig_.host().next().sequence, second);
}

TEST_F(EmulatedKinect, SendsEachFrameExactlyAndBeginsAgainAfterTheLast) {
  rig_.startDepth();
  for (const std::uint32_t frame : {0U, 1U, 2U, 0U, 1U}) {
    EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + frame)) << frame;
  }
  rig_.tell("freeze 2");
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 2));
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 2));
}

TEST_F(EmulatedKinect, BeginsThirtyFramesASecondOnTheMicroframeGrid) {
  rig_.startDepth();
  std::set<std::size_t> begins;
  const std::vector<Bytes> packets = rig_.packets(52);
  for (std::size_t microframe = 0; microframe < packets.size(); ++microframe) {
    if (!packets[microframe].empty() && packets[microframe][3] == 0x71) begins.insert(microframe);
  }
  EXPECT_EQ(begins, (std::set<std::size_t>{0, 267, 533, 800})) << "multiples of 8000 / 30, rounded";
}

TEST_F(EmulatedKinect, GivesBackAUrbThatWaitsWithoutCompletingIt) {
  const std::uint32_t first = rig_.host().submitIso(0x82, kPackets);
  const std::uint32_t second = rig_.host().submitIso(0x82, kPackets);
  const std::uint32_t unlink = rig_.host().unlink(first);
  rig_.serve();
  const KernelSide::Reply reply = rig_.host().next();
  EXPECT_EQ(reply.command, 4U);
  EXPECT_EQ(reply.sequence, unlink);
  EXPECT_EQ(reply.status, -ECONNRESET);
  rig_.advance(kUrb_ns);
  EXPECT_EQ(rig_.host().next().sequence, second);
  rig_.advance(10 * kUrb_ns);
  EXPECT_TRUE(rig_.host().hasNothing());
}

TEST_F(EmulatedKinect, SendsTheCompletionBeforeTheAnswerToAnUnlinkThatCameTooLate) {
  const std::uint32_t urb = rig_.host().submitIso(0x82, kPackets);
  rig_.serve();
  rig_.advance(kUrb_ns);
  const std::uint32_t unlink = rig_.host().unlink(urb);
  rig_.serve();
  EXPECT_EQ(rig_.host().next().sequence, urb);
  const KernelSide::Reply reply = rig_.host().next();
  EXPECT_EQ(reply.sequence, unlink);
  EXPECT_EQ(reply.status, 0);
}

TEST_F(EmulatedKinect, LeavesRequestsUnansweredWhileMuteUntilTheyAreTakenBack) {
  rig_.tell("mute");
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).status, 0) << "not a command of the camera";
  const std::uint32_t request = rig_.host().submitIn(0xc0, 0, 0, 0x200);
  rig_.serve();
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.host().unlink(request);
  rig_.serve();
  EXPECT_EQ(rig_.host().next().status, -ECONNRESET);
}

TEST_F(EmulatedKinect, LosesShortensAndSpoilsPacketsOnCommand) {
  rig_.startDepth();
  rig_.tell("lose 3");
  EXPECT_EQ(rig_.framePackets().size(), 239U);
  rig_.tell("lose off");
  EXPECT_EQ(rig_.framePackets().size(), 242U);
  rig_.tell("short");
  std::size_t of_another_size = 0;
  for (const Bytes& packet : rig_.framePackets()) {
    of_another_size += packet.size() != 1760 && packet.size() != 1144;
  }
  EXPECT_EQ(of_another_size, 1U);
  rig_.tell("garbage");
  std::size_t wrong_magic = 0;
  for (const Bytes& packet : rig_.packets(51)) wrong_magic += !packet.empty() && packet[0] != 'R';
  EXPECT_EQ(wrong_magic, 1U) << "of three frames each 401st packet, every second of them in the magic";
  EXPECT_TRUE(rig_.device().command("lose 243").starts_with("error: "));
}

}  // namespace
}  // namespace hapticd::test
