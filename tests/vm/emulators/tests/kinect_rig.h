// SPDX-License-Identifier: Apache-2.0
// The emulated camera over USB/IP as spoken by the kernel, with the time set by the tests.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "tests/support/recordings/scratch_recording.h"
#include "tests/vm/emulators/kinect/kinect_device.h"
#include "tests/vm/emulators/tests/kernel_side.h"
#include "tests/vm/emulators/usbip/connection.h"

namespace hapticd::test {

inline constexpr std::uint32_t kFrames = 3;  // recorded; numbered 10, 11, 12 where they are made up
inline constexpr std::uint32_t kFirstFrame = 10;
inline constexpr std::size_t kPackets = 16;
inline constexpr std::int64_t kUrb_ns = 2'000'000;

/// The pixels (640 x 480) of the data of a frame's packets.
std::vector<std::uint16_t> unpack(const Bytes& packed);
std::vector<std::uint16_t> madeUpImage(std::uint32_t frame);
/// Returns a command block of libfreenect.
Bytes block(std::uint16_t command, std::uint16_t tag, const std::vector<std::uint16_t>& words);

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

}  // namespace hapticd::test
