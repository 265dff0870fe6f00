// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/wire.h"

#include <algorithm>
#include <bit>

namespace hapticd::test::usbip {
namespace {

constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitReply = 3;
constexpr std::uint32_t kUnlinkReply = 4;
constexpr std::uint32_t kIn = 1;
constexpr std::uint32_t kNotIsochronous = 0xffffffff;  // that or 0

std::uint32_t get32(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

/// USB's own fields stay little-endian.
std::uint16_t getUsb16(const std::uint8_t* bytes) {
  return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
}

void put32(std::uint8_t* bytes, std::uint32_t value) {
  bytes[0] = static_cast<std::uint8_t>(value >> 24);
  bytes[1] = static_cast<std::uint8_t>(value >> 16 & 0xff);
  bytes[2] = static_cast<std::uint8_t>(value >> 8 & 0xff);
  bytes[3] = static_cast<std::uint8_t>(value & 0xff);
}

SetupPacket parseSetup(const std::uint8_t* bytes) {
  return {bytes[0], bytes[1], getUsb16(bytes + 2), getUsb16(bytes + 4), getUsb16(bytes + 6)};
}

}  // namespace

Command parseCommand(std::span<const std::uint8_t, kHeaderBytes> bytes) {
  const std::uint8_t* const at = bytes.data();
  Command command;
  command.sequence = get32(at + 4);
  const bool in = get32(at + 12) == kIn;
  command.endpoint = static_cast<std::uint8_t>((get32(at + 16) & 0x0f) | (in ? 0x80U : 0U));
  switch (get32(at)) {
    case kSubmit:
      command.kind = CommandKind::submit;
      command.transfer_bytes = get32(at + 24);
      command.start_frame = get32(at + 28);
      command.iso_packets = get32(at + 32) == kNotIsochronous ? 0 : get32(at + 32);
      command.setup = parseSetup(at + 40);
      break;
    case kUnlink:
      command.kind = CommandKind::unlink;
      command.unlink_sequence = get32(at + 20);
      break;
    default:
      break;
  }
  return command;
}

IsoDescriptor parseIsoDescriptor(std::span<const std::uint8_t, kIsoDescriptorBytes> bytes) {
  return {get32(bytes.data()), get32(bytes.data() + 4), 0, 0};
}

void writeIsoDescriptor(const IsoDescriptor& descriptor, std::span<std::uint8_t, kIsoDescriptorBytes> bytes) {
  put32(bytes.data(), descriptor.offset);
  put32(bytes.data() + 4, descriptor.length);
  put32(bytes.data() + 8, descriptor.actual_length);
  put32(bytes.data() + 12, std::bit_cast<std::uint32_t>(descriptor.status));
}

void writeSubmitReply(const SubmitReply& reply, std::span<std::uint8_t, kHeaderBytes> bytes) {
  std::ranges::fill(bytes, std::uint8_t{0});
  put32(bytes.data(), kSubmitReply);
  put32(bytes.data() + 4, reply.sequence);
  put32(bytes.data() + 20, std::bit_cast<std::uint32_t>(reply.status));
  put32(bytes.data() + 24, reply.actual_length);
  put32(bytes.data() + 28, reply.start_frame);
  put32(bytes.data() + 32, reply.iso_packets);
}

void writeUnlinkReply(std::uint32_t sequence, std::int32_t status,
                      std::span<std::uint8_t, kHeaderBytes> bytes) {
  std::ranges::fill(bytes, std::uint8_t{0});
  put32(bytes.data(), kUnlinkReply);
  put32(bytes.data() + 4, sequence);
  put32(bytes.data() + 20, std::bit_cast<std::uint32_t>(status));
}

}  // namespace hapticd::test::usbip
