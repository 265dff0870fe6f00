// The emulated camera over USB/IP as the kernel speaks it, in a time that the tests give.

#include "tests/vm/emulators/kinect/kinect_device.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <memory>
#include <set>

#include "tests/support/brute_force.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/real_recording.h"
#include "tests/support/scratch_recording.h"
#include "tests/vm/emulators/tests/kernel_side.h"
#include "tests/vm/emulators/usbip/connection.h"

namespace hapticd::test {
namespace {

constexpr std::uint32_t kFrames = 3;  // recorded; numbered 10, 11, 12 where they are made up
constexpr std::uint32_t kFirstFrame = 10;
constexpr std::size_t kPackets = 16;
constexpr std::int64_t kUrb_ns = 2'000'000;

/// The pixels (640 x 480) of the data of a frame's packets.
std::vector<std::uint16_t> unpack(const Bytes& packed) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t bit = 0; bit < raw.size() * 11; ++bit) {
    const unsigned value = packed.at(bit / 8) >> (7 - bit % 8) & 1U;
    raw[bit / 11] = static_cast<std::uint16_t>(raw[bit / 11] << 1 | value);
  }
  return raw;
}

std::vector<std::uint16_t> madeUpImage(std::uint32_t frame) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) raw[pixel] = madeUpPixel(frame, pixel);
  return raw;
}

/// A command block of libfreenect.
Bytes block(std::uint16_t command, std::uint16_t tag, const std::vector<std::uint16_t>& words) {
  Bytes bytes{'G', 'M'};
  const auto add = [&bytes](std::size_t word) {
    bytes.push_back(static_cast<std::uint8_t>(word & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  };
  add(words.size());
  add(command);
  add(tag);
  for (const std::uint16_t word : words) add(word);
  return bytes;
}

class Rig {
 public:
  explicit Rig(const std::filesystem::path& recording) {
    auto packed = PackedRecording::load(recording, kFrames);
    if (!packed) throw std::runtime_error(packed.error().text());
    KinectOptions options;
    options.serial = "K1";
    device_ = std::make_unique<KinectDevice>(std::move(*packed), options, [](std::string_view) {});
    const SocketPair sockets;
    connection_ =
        std::make_unique<usbip::Connection>(sockets.device, *device_, counts_, [](std::string_view) {});
    host_ = std::make_unique<KernelSide>(sockets.kernel);
  }

  KernelSide& host() { return *host_; }
  KinectDevice& device() { return *device_; }
  usbip::Connection& connection() { return *connection_; }
  const usbip::UrbCounts& counts() const { return counts_; }

  /// Lets the device read what was sent, at the present time.
  void serve() {
    connection_->receive();
    device_->work(now_ns_, *connection_);
  }
  void advance(std::int64_t by_ns) {
    now_ns_ += by_ns;
    serve();
  }

  KernelSide::Reply in(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                       std::uint16_t length) {
    host_->submitIn(request_type, request, value, length);
    serve();
    return host_->next();
  }
  KernelSide::Reply out(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                        const Bytes& data = {}) {
    host_->submitOut(request_type, request, value, data);
    serve();
    return host_->next();
  }
  /// A command and its reply.
  Bytes command(std::uint16_t command, std::uint16_t tag, const std::vector<std::uint16_t>& words) {
    const Bytes sent = block(command, tag, words);
    EXPECT_EQ(out(0x40, 0, 0, sent).actual_length, sent.size());
    return in(0xc0, 0, 0, 0x200).data;
  }
  void startDepth() { command(0x03, 0, {0x06, 2}); }
  void tell(std::string_view line) { EXPECT_EQ(device_->command(line), "ok") << line; }

  /// The packets of the next URBs, each submitted when the one before is complete.
  std::vector<Bytes> packets(std::size_t urbs) {
    std::vector<Bytes> all;
    for (std::size_t urb = 0; urb < urbs; ++urb) {
      host_->submitIso(0x82, kPackets);
      serve();
      advance(kUrb_ns);
      const KernelSide::Reply reply = host_->next();
      all.insert(all.end(), reply.packets.begin(), reply.packets.end());
    }
    return all;
  }
  /// Those of the rest of this frame, without empty ones; what follows is kept for the next call.
  std::vector<Bytes> framePackets() {
    std::vector<Bytes> all;
    while (all.empty() || all.back().at(3) != 0x75) {
      if (unread_.empty()) unread_ = packets(1);
      if (!unread_.front().empty()) all.push_back(unread_.front());
      unread_.erase(unread_.begin());
    }
    return all;
  }
  /// Those that are not empty of 17 URBs, about a frame period.
  std::vector<Bytes> packetsOfOnePeriod() {
    std::vector<Bytes> all = packets(17);
    std::erase_if(all, [](const Bytes& packet) { return packet.empty(); });
    return all;
  }
  std::vector<std::uint16_t> image() {
    Bytes packed;
    for (const Bytes& packet : framePackets()) packed.insert(packed.end(), packet.begin() + 12, packet.end());
    return unpack(packed);
  }

 private:
  usbip::UrbCounts counts_;
  std::unique_ptr<KinectDevice> device_;
  std::unique_ptr<usbip::Connection> connection_;
  std::unique_ptr<KernelSide> host_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::vector<Bytes> unread_;
};

class EmulatedKinect : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    recording_ = new ScratchRecording;
    for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
      recording_->add(kFirstFrame + frame, "1500000000." + std::to_string(100 + frame), frame);
    }
    recording_->writeIndex();
  }
  static void TearDownTestSuite() {
    delete recording_;
    recording_ = nullptr;
  }

  Rig rig_{recording_->path()};

  static inline ScratchRecording* recording_ = nullptr;
};

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
    EXPECT_EQ(packets[100][5], sequence) << "the sequence number tells";
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

// GET_CONFIGURATION: request 1 of device 1-2, IN, endpoint 0
const Bytes kRequest{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 2, 0, 0, 0, 1, 0,    0, 0, 0, 0, 0, 0, 0,
                     0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 8, 0, 0, 0, 0, 1, 0};

TEST_F(EmulatedKinect, UnderstandsRequestsThatArriveByteByByte) {
  for (const std::uint8_t byte : kRequest) {
    EXPECT_EQ(rig_.counts().completed, 0U);
    rig_.host().send({byte});
    rig_.serve();
  }
  EXPECT_EQ(rig_.counts().completed, 1U);
}

TEST_F(EmulatedKinect, UnderstandsRequestsThatArriveTogetherWithAPartOfTheNext) {
  Bytes one_and_a_half = kRequest;
  one_and_a_half.insert(one_and_a_half.end(), kRequest.begin(), kRequest.begin() + 24);
  rig_.host().send(one_and_a_half);
  rig_.serve();
  EXPECT_EQ(rig_.counts().completed, 1U);
  rig_.host().send(Bytes(kRequest.begin() + 24, kRequest.end()));
  rig_.serve();
  EXPECT_EQ(rig_.counts().completed, 2U);
  EXPECT_TRUE(rig_.connection().isAlive());
}

TEST_F(EmulatedKinect, GivesUpAConnectionOnWhichItUnderstandsNothing) {
  rig_.host().send(Bytes(48, 0xee));
  rig_.serve();
  EXPECT_FALSE(rig_.connection().isAlive());
}

TEST_F(EmulatedKinect, NoticesThatTheKernelHasHungUp) {
  rig_.host().hangUp();
  rig_.serve();
  EXPECT_FALSE(rig_.connection().isAlive());
}

TEST(EmulatedKinectOnARecording, SendsTheFramesOfARealOneExactly) {
  const std::string archive = "02_raw11_desk_near/desk_near.tar.xz";
  const UnpackedRecording recording(archive);
  if (!recording.found()) GTEST_SKIP() << archive << " is not there: set HAPTICD_RECORDINGS";
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
