// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tests/support/kinect/depth_packets.h"
#include "tests/support/kinect/kinect_commands.h"
#include "tests/vm/emulators/kinect/packed_recording.h"
#include "tests/vm/emulators/kinect/stream_faults.h"
#include "tests/vm/emulators/usbip/connection.h"
#include "tests/vm/emulators/usbip/usb_device.h"

namespace hapticd::test {

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
