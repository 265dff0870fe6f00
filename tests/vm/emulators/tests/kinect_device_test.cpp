// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <memory>
#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "tests/support/made_up_pixel.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/vm/emulators/kinect/kinect_device.h"
#include "tests/vm/emulators/tests/kernel_side.h"
#include "tests/vm/emulators/usbip/connection.h"

namespace hapticd::test {
namespace {

// The emulated camera over USB/IP as spoken by the kernel, with the time set by the tests.

constexpr std::uint32_t kFrames = 3;  // recorded; numbered 10, 11, 12 where they are made up
constexpr std::uint32_t kFirstFrame = 10;
constexpr std::size_t kPackets = 16;
constexpr std::int64_t kUrb_ns = 2'000'000;

/// The pixels (640 x 480) of the data of a frame's packets.
std::vector<std::uint16_t> unpack(const Bytes& packed) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t bit = 0; bit < raw.size() * 11; ++bit) {
    const unsigned value = unsigned{packed.at(bit / 8)} >> (7 - bit % 8) & 1U;
    raw[bit / 11] = static_cast<std::uint16_t>(unsigned{raw[bit / 11]} << 1 | value);
  }
  return raw;
}

std::vector<std::uint16_t> madeUpImage(std::uint32_t frame) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) raw[pixel] = madeUpPixel(frame, pixel);
  return raw;
}

/// Returns a command block of libfreenect.
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

/// The camera and the kernel's side of it.
class Rig {
 public:
  explicit Rig(const std::filesystem::path& recording) {
    auto packed = PackedRecording::load(recording, kFrames);
    if (!packed) throw std::runtime_error(packed.error().text());
    device_ = std::make_unique<KinectDevice>(std::move(*packed), "K1", [](std::string_view) {});
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
  /// Sends a command and returns its reply.
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
  /// Returns the packets of the rest of this frame, without empty ones; later ones are kept for the next
  /// call.
  std::vector<Bytes> framePackets() {
    std::vector<Bytes> all;
    while (all.empty() || all.back().at(3) != 0x75) {
      if (unread_.empty()) unread_ = packets(1);
      if (!unread_.front().empty()) all.push_back(unread_.front());
      unread_.erase(unread_.begin());
    }
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

/// The emulated camera on a recording of synthetic frames.
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

// The emulated camera as a kernel meets it. What its commands and packets hold is tried with the real
// libfreenect in tests/unit/drivers/fake_kinect_test.cpp, which shares them.

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
