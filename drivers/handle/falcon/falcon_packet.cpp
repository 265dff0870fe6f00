// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_packet.h"

#include <algorithm>

namespace hapticd::drivers {
namespace {

constexpr std::uint8_t kFirstByte = '<';
constexpr std::uint8_t kLastByte = '>';
constexpr std::uint8_t kZero = 'A';
constexpr std::size_t kNibbles = 12;      // of three numbers, from byte 1 on
constexpr std::size_t kControlByte = 13;  // in orders; in replies: buttons and homed encoders
constexpr std::uint8_t kHomingRequest = 0x01;

std::uint8_t coded(unsigned value) {
  return static_cast<std::uint8_t>(kZero + value);
}

bool isNibble(std::uint8_t byte) {
  return byte >= kZero && byte < kZero + 16;
}

/// Returns whether a frame may have this byte at this index; the meaning of byte 14 is unknown.
bool mayStand(std::uint8_t byte, std::size_t index) {
  if (index == 0) return byte == kFirstByte;
  if (index <= kNibbles) return isNibble(byte);
  return index + 1 < kFalconFrameBytes || byte == kLastByte;
}

}  // namespace

FalconFrame frameOf(const FalconOrder& order) {
  FalconFrame frame{};
  frame.fill(kZero);
  frame.front() = kFirstByte;
  frame.back() = kLastByte;
  std::size_t at = 1;
  for (const int counts : order.motor_counts) {
    const auto bits = static_cast<std::uint16_t>(std::clamp(counts, -kMaxMotorCounts, kMaxMotorCounts));
    for (unsigned shift = 0; shift < 16; shift += 4) frame[at++] = coded((bits >> shift) & 0xFU);
  }
  frame[kControlByte] = coded(static_cast<unsigned>(order.led) | (order.home ? kHomingRequest : 0U));
  return frame;
}

std::optional<FalconReply> replyIn(const FalconFrame& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (!mayStand(frame[i], i)) return std::nullopt;
  }
  FalconReply reply;
  std::size_t at = 1;
  for (int& counts : reply.encoder_counts) {
    unsigned bits = 0;
    for (unsigned shift = 0; shift < 16; shift += 4)
      bits |= static_cast<unsigned>(frame[at++] - kZero) << shift;
    counts = static_cast<std::int16_t>(bits);
  }
  const auto state = static_cast<std::uint8_t>(frame[kControlByte] - kZero);
  reply.buttons = state & 0xFU;
  reply.homed = (state >> 4U) & kAllHomed;
  return reply;
}

std::optional<FalconReply> FalconReplyStream::add(std::uint8_t byte) {
  frame_[length_] = byte;
  if (!mayStand(byte, length_)) {
    if (in_step_) ++damaged_;
    resynchronise();
    return std::nullopt;
  }
  in_step_ = true;
  if (++length_ < kFalconFrameBytes) return std::nullopt;
  length_ = 0;
  return replyIn(frame_);
}

/// Handles a byte that does not fit after the frame's first length_ bytes. Bytes 13 and 14 may have any
/// value, so the next frame may have begun among the last bytes.
void FalconReplyStream::resynchronise() {
  const std::size_t end = length_ + 1;
  length_ = 0;
  for (std::size_t i = 1; i < end; ++i) {
    if (!mayStand(frame_[i], length_)) length_ = 0;
    if (mayStand(frame_[i], length_)) frame_[length_++] = frame_[i];
  }
  in_step_ = length_ > 0;
}

void FalconReplyStream::reset() {
  if (length_ > 0) ++damaged_;
  length_ = 0;
}

std::size_t removeStatusBytes(std::span<std::uint8_t> transfer) {
  constexpr std::size_t kPacketBytes = 64;
  constexpr std::size_t kStatusBytes = 2;
  std::size_t carried = 0;
  for (std::size_t packet = 0; packet < transfer.size(); packet += kPacketBytes) {
    const std::size_t end = std::min(packet + kPacketBytes, transfer.size());
    for (std::size_t i = packet + kStatusBytes; i < end; ++i) transfer[carried++] = transfer[i];
  }
  return carried;
}

}  // namespace hapticd::drivers
