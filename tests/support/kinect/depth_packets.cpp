// SPDX-License-Identifier: Apache-2.0
#include "tests/support/kinect/depth_packets.h"

#include <algorithm>
#include <cstring>

namespace hapticd::test::kinect {
namespace {

constexpr std::uint8_t kFirst = 0x71;
constexpr std::uint8_t kMiddle = 0x72;
constexpr std::uint8_t kLast = 0x75;

}  // namespace

void packDepth(std::span<const std::uint16_t, kPixels> raw,
               std::span<std::uint8_t, kPackedFrameBytes> packed) noexcept {
  std::uint32_t bits = 0;
  unsigned waiting = 0;  // bits not written yet, fewer than 8 between two pixels
  std::size_t at = 0;
  for (const std::uint16_t value : raw) {
    bits = bits << 11 | (value & 0x7ffU);
    waiting += 11;
    for (; waiting >= 8; waiting -= 8)
      packed[at++] = static_cast<std::uint8_t>(bits >> (waiting - 8) & 0xffU);
  }
}

void DepthPackets::begin(std::span<const std::uint8_t, kPackedFrameBytes> packed,
                         std::uint32_t ticks) noexcept {
  packed_ = packed.data();
  ticks_ = ticks;
  index_ = 0;
}

std::size_t DepthPackets::next(std::span<std::uint8_t, kMaxPacketBytes> out) noexcept {
  const std::size_t begin = index_ * kPacketDataBytes;
  const std::size_t count = std::min(kPacketDataBytes, kPackedFrameBytes - begin);
  const std::uint8_t flag = index_ == 0 ? kFirst : index_ + 1 == kPacketsPerFrame ? kLast : kMiddle;
  const std::uint8_t header[kPacketHeaderBytes] = {'R',
                                                   'B',
                                                   0,
                                                   flag,
                                                   0,
                                                   sequence_++,
                                                   0,
                                                   0,
                                                   static_cast<std::uint8_t>(ticks_ & 0xff),
                                                   static_cast<std::uint8_t>(ticks_ >> 8 & 0xff),
                                                   static_cast<std::uint8_t>(ticks_ >> 16 & 0xff),
                                                   static_cast<std::uint8_t>(ticks_ >> 24)};
  std::memcpy(out.data(), header, sizeof header);
  std::memcpy(out.data() + sizeof header, packed_ + begin, count);
  ++index_;
  return sizeof header + count;
}

}  // namespace hapticd::test::kinect
