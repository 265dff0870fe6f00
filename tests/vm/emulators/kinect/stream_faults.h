// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test {

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

}  // namespace hapticd::test
