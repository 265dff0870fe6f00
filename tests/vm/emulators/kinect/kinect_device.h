// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "tests/support/kinect/kinect_protocol.h"
#include "tests/vm/emulators/usbip/connection.h"
#include "tests/vm/emulators/usbip/usb_device.h"

namespace hapticd::test {

/// The first frames of a recording as the camera sends them.  Thread: any, for reading.
class PackedRecording {
 public:
  using Frame = std::span<const std::uint8_t, kinect::kPackedFrameBytes>;

  /// most_frames: at least 1.  Errors: those of the recording; each frame is checked.
  static base::Result<PackedRecording> load(const std::filesystem::path& folder, std::size_t most_frames);

  std::size_t frames() const { return packed_.size() / kinect::kPackedFrameBytes; }
  /// index: below frames().
  Frame frame(std::size_t index) const {
    return std::span(packed_).subspan(index * kinect::kPackedFrameBytes).first<kinect::kPackedFrameBytes>();
  }

 private:
  std::vector<std::uint8_t> packed_;
};

/// Faults of depth packets in transit. The same faults always hit the same packets of a frame.
class StreamFaults {
 public:
  /// Leaves out so many packets in a row, at most kinect::kPacketsPerFrame, of each following frame.
  void lose(std::size_t packets) { lose_next_ = packets; }
  void sendGarbage() { garbage_ = true; }
  void sendShortPackets() { short_ = true; }
  /// Ends all of them.
  void clear();

  /// To be called before the first packet of a frame.
  void beginFrame() { lose_now_ = lose_next_; }
  /// Applies the faults to packet `index` of the frame: may change its bytes; returns its length, 0 if it is
  /// lost.
  std::size_t apply(std::size_t index, std::span<std::uint8_t> packet) noexcept;

 private:
  void spoilHeader(std::span<std::uint8_t> header) noexcept;
  std::uint8_t randomByte() noexcept;

  std::size_t lose_next_ = 0;
  std::size_t lose_now_ = 0;  // in the frame in progress
  bool garbage_ = false;
  bool short_ = false;
  std::uint64_t since_garbage_ = 0;  // packets since it was asked for
  std::uint32_t random_ = 1;
  std::uint64_t garbage_packets_ = 0;
};

/// The camera as a USB device. Its commands are described in README.md.
class KinectDevice final : public usbip::UsbDevice {
 public:
  /// `recording`: at least one frame. `serial`: ASCII, at most 126 characters.
  KinectDevice(PackedRecording recording, const std::string& serial, usbip::Log log);

  const usbip::Descriptors& descriptors() const override { return descriptors_; }
  void reset() override;
  bool answers(const usbip::SetupPacket& setup) const override;
  usbip::ControlAnswer control(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) override;
  std::size_t isoPacket(std::uint8_t endpoint, usbip::IsoPacketBuffer out) override;
  void work(std::int64_t now_ns, usbip::PendingUrbs& urbs) override;
  std::optional<std::int64_t> due_ns(const usbip::PendingUrbs& urbs) const override;
  std::string command(std::string_view line) override;
  std::string commands() const override;
  std::string status() const override;

 private:
  /// When the bus polls an endpoint.
  struct Schedule {
    std::uint8_t endpoint;
    /// End of the URB that was completed last, begin of the next one; nothing while the host wants nothing.
    std::optional<std::int64_t> busy_until_ns = std::nullopt;
  };

  void execute(std::span<const std::uint8_t> command);
  void poll(Schedule& schedule, std::int64_t now_ns, usbip::PendingUrbs& urbs);
  void beginFrame();
  std::uint64_t nextFrameAt() const;
  std::string lose(std::string_view argument);
  std::string freeze(std::string_view argument);
  void resume();

  PackedRecording recording_;
  usbip::Log log_;
  usbip::Descriptors descriptors_;
  kinect::KinectCommands commands_;
  kinect::DepthPackets packets_;
  StreamFaults faults_;
  bool mute_ = false;  // commands are not answered
  bool stall_ = false;
  bool frozen_ = false;
  Schedule video_{kinect::kVideoEndpoint};
  Schedule depth_{kinect::kDepthEndpoint};
  std::uint64_t microframe_ = 0;    // since depth was started; 125 us each
  std::uint64_t frames_begun_ = 0;  // since then
  std::uint64_t frames_sent_ = 0;   // since then
  std::size_t next_frame_ = 0;      // of the recording
};

}  // namespace hapticd::test
