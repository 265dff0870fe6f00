// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>

#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test::kinect {

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
