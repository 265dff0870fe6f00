// SPDX-License-Identifier: Apache-2.0
// The emulated camera without faults.

#include <gtest/gtest.h>

#include <cerrno>
#include <set>

#include "tests/support/raw_image.h"
#include "tests/support/recording.h"
#include "tests/vm/emulators/tests/kinect_rig.h"

namespace hapticd::test {
namespace {

TEST_F(EmulatedKinect, IsEnumeratedAsTheCameraOfAModel1414) {
  EXPECT_EQ(rig_.in(0x80, 6, 0x0100, 64).data,
            (Bytes{18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x5e, 0x04, 0xae, 0x02, 0x0b, 0x01, 2, 1, 3, 1}));
  const Bytes configuration = rig_.in(0x80, 6, 0x0200, 9).data;
  EXPECT_EQ(configuration, (Bytes{9, 2, 32, 0, 1, 1, 0, 0xc0, 8}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0200, 255).data, (Bytes{9, 2, 32,   0, 1,    1,    0,    0xc0, 8,  //
                                                       9, 4, 0,    0, 2,    0xff, 0xff, 0xff, 0,  //
                                                       7, 5, 0x81, 1, 0xc0, 0x0b, 1,              //
                                                       7, 5, 0x82, 1, 0xc0, 0x0b, 1}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0600, 10).data, (Bytes{10, 6, 0x00, 0x02, 0, 0, 0, 64, 1, 0}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0300, 255).data, (Bytes{4, 3, 0x09, 0x04}));
  EXPECT_EQ(rig_.in(0x80, 6, 0x0303, 255).data, (Bytes{6, 3, 'K', 0, '1', 0}));
}

TEST_F(EmulatedKinect, IsConfiguredByTheHost) {
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).data, Bytes{0});
  EXPECT_EQ(rig_.out(0x00, 9, 1).status, 0);
  EXPECT_TRUE(rig_.connection().isConfigured());
  EXPECT_EQ(rig_.in(0x80, 8, 0, 1).data, Bytes{1});
  EXPECT_EQ(rig_.out(0x01, 11, 0).status, 0) << "alternate setting 0";
}

TEST_F(EmulatedKinect, StallsAtRequestsThatItDoesNotKnow) {
  EXPECT_EQ(rig_.in(0x80, 6, 0x0f00, 5).status, -EPIPE) << "BOS descriptor";
  EXPECT_EQ(rig_.in(0x80, 6, 0x0309, 255).status, -EPIPE) << "string 9";
  EXPECT_EQ(rig_.out(0x00, 9, 2).status, -EPIPE) << "configuration 2";
  EXPECT_EQ(rig_.out(0x01, 11, 1).status, -EPIPE) << "alternate setting 1";
  EXPECT_EQ(rig_.in(0xc0, 0x10, 0, 1).status, -EPIPE) << "of the motor";
}

TEST_F(EmulatedKinect, AnswersTheCommandsWithWhichLibfreenectOpensIt) {
  EXPECT_EQ(rig_.command(0x16, 0, {0x41, 0, 0, 0, 0}).size(), 8 + 8U);
  const Bytes zero_plane = rig_.command(0x04, 1, {0, 0, 0, 0, 0});
  ASSERT_EQ(zero_plane.size(), 8 + 322U);
  EXPECT_EQ(Bytes(zero_plane.begin(), zero_plane.begin() + 8), (Bytes{'R', 'B', 161, 0, 0x04, 0, 1, 0}));
  EXPECT_EQ(Bytes(zero_plane.begin() + 8 + 94, zero_plane.begin() + 8 + 98), (Bytes{0, 0, 0xf0, 0x40}))
      << "7.5";
  EXPECT_EQ(rig_.command(0x16, 2, {0x40, 0, 1, 30, 0}).size(), 8 + 118U);
  EXPECT_EQ(rig_.command(0x16, 3, {0, 0, 0, 0, 0}), (Bytes{'R', 'B', 2, 0, 0x16, 0, 3, 0, 0, 0, 200, 0}));
  EXPECT_EQ(rig_.in(0xc0, 0, 0, 0x200).actual_length, 0U) << "a reply is given once";
}

TEST_F(EmulatedKinect, KeepsItsRegisters) {
  EXPECT_EQ(rig_.command(0x03, 0, {0x12, 3}), (Bytes{'R', 'B', 1, 0, 0x03, 0, 0, 0, 0, 0}));
  EXPECT_EQ(rig_.command(0x02, 1, {0x12}), (Bytes{'R', 'B', 2, 0, 0x02, 0, 1, 0, 0, 0, 3, 0}));
  const Bytes written = rig_.command(0x95, 2, {1, 0x8106, 0x5a});
  EXPECT_EQ(rig_.command(0x95, 2, {1, 0x0106, 0}), written);
  EXPECT_EQ(written, (Bytes{'R', 'B', 3, 0, 0x95, 0, 2, 0, 0, 0, 0, 0, 0x5a, 0}));
}

TEST_F(EmulatedKinect, IgnoresACommandThatIsCutOff) {
  Bytes cut = block(0x03, 0, {0x06, 2});
  cut.pop_back();
  rig_.out(0x40, 0, 0, cut);
  EXPECT_EQ(rig_.in(0xc0, 0, 0, 0x200).actual_length, 0U);
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
  EXPECT_EQ(reply.status, 0);
  EXPECT_EQ(reply.actual_length, 0U);
  EXPECT_EQ(reply.packets.size(), kPackets);
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.advance(kUrb_ns);
  EXPECT_EQ(rig_.host().next().sequence, second);
}

TEST_F(EmulatedKinect, CatchesUpAfterHavingBeenLateItself) {
  for (int urb = 0; urb < 5; ++urb) rig_.host().submitIso(0x82, kPackets);
  rig_.serve();
  rig_.advance(3 * kUrb_ns + kUrb_ns / 2);
  for (int urb = 0; urb < 3; ++urb) rig_.host().next();
  EXPECT_TRUE(rig_.host().hasNothing());
  rig_.advance(kUrb_ns / 2);
  EXPECT_EQ(rig_.host().next().command, 3U) << "on the grid of the first";
}

TEST_F(EmulatedKinect, SendsEachFrameExactlyAndBeginsAgainAfterTheLast) {
  rig_.startDepth();
  for (const std::uint32_t frame : {0U, 1U, 2U, 0U, 1U}) {
    EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + frame)) << frame;
  }
}

TEST_F(EmulatedKinect, SendsAFrameAsPacketsOfTheCamera) {
  rig_.startDepth();
  const std::vector<Bytes> packets = rig_.framePackets();
  ASSERT_EQ(packets.size(), 242U);
  for (std::size_t index = 0; index < packets.size(); ++index) {
    const Bytes& packet = packets[index];
    EXPECT_EQ(packet.size(), 12U + (index < 241 ? 1748 : 1132)) << index;
    EXPECT_EQ(Bytes(packet.begin(), packet.begin() + 2), (Bytes{'R', 'B'})) << index;
    EXPECT_EQ(packet[3], index == 0 ? 0x71 : index < 241 ? 0x72 : 0x75) << index;
    EXPECT_EQ(packet[5], index) << "sequence";
  }
  EXPECT_EQ(rig_.framePackets().front()[5], 242) << "runs on from frame to frame";
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

TEST_F(EmulatedKinect, AnswersEachPacketAtTheOffsetThatTheHostGave) {
  rig_.startDepth();
  rig_.host().submitIso(0x82, 4);
  rig_.serve();
  rig_.advance(kUrb_ns);
  EXPECT_EQ(rig_.host().next().offsets, (std::vector<std::uint32_t>{0, 1920, 3840, 5760}));
}

TEST_F(EmulatedKinect, SendsNothingAfterDepthIsStoppedAndAWholeFrameAfterItIsStartedAgain) {
  rig_.startDepth();
  rig_.packets(5);
  rig_.command(0x03, 0, {0x06, 0});
  for (const Bytes& packet : rig_.packets(2)) EXPECT_TRUE(packet.empty());
  rig_.startDepth();
  EXPECT_EQ(rig_.image(), madeUpImage(kFirstFrame + 1));
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
  EXPECT_EQ(rig_.counts().unlinked, 1U);
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
  EXPECT_EQ(reply.command, 4U);
  EXPECT_EQ(reply.status, 0);
  EXPECT_EQ(rig_.counts().unlinked_late, 1U);
}

TEST(EmulatedKinectOnARecording, SendsItsFramesExactly) {
  const Recording recording("02_raw11_desk_near/desk_near.tar.xz");
  std::set<std::filesystem::path> images;  // their names begin with the time
  for (const auto& entry : std::filesystem::directory_iterator(recording.path())) {
    if (entry.path().extension() == ".pgm") images.insert(entry.path());
  }
  Rig rig(recording.path());
  rig.startDepth();
  EXPECT_EQ(rig.image(), rawPixelsOf(*images.begin()));
  EXPECT_EQ(rig.image(), rawPixelsOf(*std::next(images.begin())));
}

TEST(PackedRecording, NamesWhatIsWrongWithAFolder) {
  const TemporaryFolder folder;
  const auto recording = PackedRecording::load(folder.path(), 1);
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().text().find("INDEX.txt"), std::string::npos) << recording.error().text();
}

}  // namespace
}  // namespace hapticd::test
