// SPDX-License-Identifier: Apache-2.0
#include "tests/support/kinect/kinect_protocol.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

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

namespace {

constexpr std::size_t kHeaderBytes = 8;

constexpr std::uint16_t kReadRegister = 0x02;
constexpr std::uint16_t kWriteRegister = 0x03;
constexpr std::uint16_t kZeroPlane = 0x04;
constexpr std::uint16_t kRegistration = 0x16;
constexpr std::uint16_t kSensor = 0x95;

constexpr std::uint16_t kDepthStreamRegister = 0x06;
constexpr std::uint16_t kDepthStreamOn = 2;
constexpr std::uint16_t kSensorWrite = 0x8000;

/// Returns a word; 0 beyond the end.
std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t index) {
  if (bytes.size() < 2 * index + 2) return 0;
  return static_cast<std::uint16_t>(bytes[2 * index] | bytes[2 * index + 1] << 8);
}

void putWord(std::span<std::uint8_t> bytes, std::size_t index, std::size_t value) {
  bytes[2 * index] = static_cast<std::uint8_t>(value & 0xff);
  bytes[2 * index + 1] = static_cast<std::uint8_t>(value >> 8 & 0xff);
}

void putFloat(std::span<std::uint8_t> bytes, std::size_t at, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (std::size_t byte = 0; byte < 4; ++byte) bytes[at + byte] = static_cast<std::uint8_t>(bits >> 8 * byte);
}

}  // namespace

void KinectCommands::command(std::span<const std::uint8_t> bytes) {
  reply_bytes_ = 0;
  if (bytes.size() < kHeaderBytes || bytes[0] != 'G' || bytes[1] != 'M') return;
  if (bytes.size() < kHeaderBytes + 2 * std::size_t{word(bytes, 1)}) return;
  command_ = word(bytes, 2);
  tag_ = word(bytes, 3);
  const Payload payload = bytes.subspan(kHeaderBytes, 2 * std::size_t{word(bytes, 1)});
  switch (command_) {
    case kReadRegister:
      return readRegister(payload);
    case kWriteRegister:
      return writeRegister(payload);
    case kZeroPlane:
      return sendZeroPlane();
    case kRegistration:
      return sendRegistration(payload);
    case kSensor:
      return accessSensor(payload);
    default:
      beginReply(2);
  }
}

std::span<const std::uint8_t> KinectCommands::takeReply() {
  return std::span(reply_).first(std::exchange(reply_bytes_, 0));
}

/// Returns the reply's payload, all zero (so its first word means success).
std::span<std::uint8_t> KinectCommands::beginReply(std::size_t payload_bytes) {
  reply_bytes_ = kHeaderBytes + payload_bytes;
  const std::span<std::uint8_t> reply = std::span(reply_).first(reply_bytes_);
  std::ranges::fill(reply, std::uint8_t{0});
  reply[0] = 'R';
  reply[1] = 'B';
  putWord(reply, 1, payload_bytes / 2);
  putWord(reply, 2, command_);
  putWord(reply, 3, tag_);
  return reply.subspan(kHeaderBytes);
}

void KinectCommands::readRegister(Payload payload) {
  const auto found = registers_.find(word(payload, 0));
  putWord(beginReply(4), 1, found != registers_.end() ? found->second : 0);
}

void KinectCommands::writeRegister(Payload payload) {
  const std::uint16_t address = word(payload, 0);
  const std::uint16_t value = word(payload, 1);
  registers_[address] = value;
  if (address == kDepthStreamRegister) streams_depth_ = value == kDepthStreamOn;
  beginReply(2);
}

/// Handles access to the image sensor's own registers.
void KinectCommands::accessSensor(Payload payload) {
  const auto address = static_cast<std::uint16_t>(word(payload, 1) & ~kSensorWrite);
  std::uint16_t& value = sensor_registers_[address];
  if ((word(payload, 1) & kSensorWrite) != 0) value = word(payload, 2);
  putWord(beginReply(6), 2, value);
}

void KinectCommands::sendZeroPlane() {
  const std::span<std::uint8_t> payload = beginReply(322);
  putFloat(payload, 94, 7.5F);      // distance between emitter and camera, cm
  putFloat(payload, 98, 2.3F);      // distance between colour and depth camera, cm
  putFloat(payload, 102, 120.0F);   // reference distance, mm
  putFloat(payload, 106, 0.1042F);  // pixel size at the reference distance, mm
}

void KinectCommands::sendRegistration(Payload payload) {
  switch (word(payload, 0)) {
    case 0x41:
      beginReply(8);
      return;
    case 0x40:
      beginReply(118);
      return;
    default:
      putWord(beginReply(4), 1, 200);  // constant shift
  }
}

}  // namespace hapticd::test::kinect
