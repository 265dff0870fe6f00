// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test::kinect {

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

}  // namespace hapticd::test::kinect
