// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

/// The camera of a Kinect v1 (model 1414) as seen by USB and libfreenect.
namespace hapticd::test::kinect {

inline constexpr std::uint16_t kVendor = 0x045e;
inline constexpr std::uint16_t kProduct = 0x02ae;
inline constexpr std::uint16_t kRelease = 0x010b;  // any other release is treated as a later model
inline constexpr std::uint8_t kSerialString = 3;   // index of its string descriptor

inline constexpr std::uint8_t kVideoEndpoint = 0x81;
inline constexpr std::uint8_t kDepthEndpoint = 0x82;
inline constexpr std::size_t kMaxPacketBytes = 1920;  // two transactions of 960 bytes per microframe

inline constexpr std::size_t kPixels = 640 * 480;
inline constexpr std::size_t kPackedFrameBytes = kPixels * 11 / 8;
inline constexpr std::size_t kPacketHeaderBytes = 12;
inline constexpr std::size_t kPacketDataBytes = 1748;  // of every depth packet except the last
inline constexpr std::size_t kPacketsPerFrame = (kPackedFrameBytes + kPacketDataBytes - 1) / kPacketDataBytes;
static_assert(kPacketsPerFrame == 242);

inline constexpr std::size_t kMaxReplyBytes = 0x200;  // length requested by libfreenect

/// Packs raw disparities as the camera sends them: 11 bits each, most significant bit first, without gaps.
/// Higher bits are ignored.
void packDepth(std::span<const std::uint16_t, kPixels> raw,
               std::span<std::uint8_t, kPackedFrameBytes> packed) noexcept;

/// Splits frames into isochronous packets. The sequence number of the packets continues from frame to frame.
class DepthPackets {
 public:
  /// `packed` must outlive its packets. `ticks`: the camera's time, sent with each packet.
  void begin(std::span<const std::uint8_t, kPackedFrameBytes> packed, std::uint32_t ticks) noexcept;

  /// Returns the index of the next packet; kPacketsPerFrame when the frame is finished.
  std::size_t index() const { return index_; }
  bool done() const { return index_ == kPacketsPerFrame; }

  /// Writes the next packet and returns its length in bytes. Must not be called when done(). A packet that is
  /// to be lost must be taken as well, because of its sequence number.
  std::size_t next(std::span<std::uint8_t, kMaxPacketBytes> out) noexcept;

 private:
  const std::uint8_t* packed_ = nullptr;
  std::uint32_t ticks_ = 0;
  std::size_t index_ = kPacketsPerFrame;
  std::uint8_t sequence_ = 0;
};

/// The camera's control endpoint: a command arrives as a vendor OUT request, its reply is fetched by a vendor
/// IN request.
/// Thread: one at a time.
class KinectCommands {
 public:
  /// Executes one command block ("GM", payload words, command, tag, payload; little-endian). Invalid or
  /// truncated blocks are ignored as by the camera: there is no reply.
  void command(std::span<const std::uint8_t> bytes);

  /// Returns the reply to the newest command once, then nothing. Valid until the next command().
  std::span<const std::uint8_t> takeReply();

  /// Returns whether depth has been started and not stopped (register 0x06).
  bool streamsDepth() const { return streams_depth_; }

 private:
  using Payload = std::span<const std::uint8_t>;

  std::span<std::uint8_t> beginReply(std::size_t payload_bytes);
  void readRegister(Payload payload);
  void writeRegister(Payload payload);
  void accessSensor(Payload payload);
  void sendZeroPlane();
  void sendRegistration(Payload payload);

  std::map<std::uint16_t, std::uint16_t> registers_;
  std::map<std::uint16_t, std::uint16_t> sensor_registers_;
  bool streams_depth_ = false;
  std::uint16_t command_ = 0;  // of the command in progress
  std::uint16_t tag_ = 0;
  std::array<std::uint8_t, kMaxReplyBytes> reply_{};
  std::size_t reply_bytes_ = 0;
};

}  // namespace hapticd::test::kinect
