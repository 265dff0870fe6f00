// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test::kinect {

/// Packs raw disparities as the camera sends them: 11 bits each, most significant bit first, without gaps.
/// Bits above the eleventh are left out.
void packDepth(std::span<const std::uint16_t, kPixels> raw,
               std::span<std::uint8_t, kPackedFrameBytes> packed) noexcept;

/// Frames as isochronous packets. The packets' sequence number runs on from frame to frame.
class DepthPackets {
 public:
  /// `packed` must outlive its packets. `ticks`: the camera's time, sent with each packet.
  void begin(std::span<const std::uint8_t, kPackedFrameBytes> packed, std::uint32_t ticks) noexcept;

  /// Index of the packet that is next, kPacketsPerFrame when all of the frame were taken.
  std::size_t index() const { return index_; }
  bool done() const { return index_ == kPacketsPerFrame; }

  /// Writes the next packet and returns its length in bytes. Not to be called when done(). A packet that is
  /// to be lost must be taken all the same, for its sequence number.
  std::size_t next(std::span<std::uint8_t, kMostPacketBytes> out) noexcept;

 private:
  const std::uint8_t* packed_ = nullptr;
  std::uint32_t ticks_ = 0;
  std::size_t index_ = kPacketsPerFrame;
  std::uint8_t sequence_ = 0;
};

}  // namespace hapticd::test::kinect
