// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// USB/IP as the kernel's vhci_hcd speaks it after an attachment: headers of 48 bytes, all numbers
/// big-endian.
namespace hapticd::test::usbip {

inline constexpr std::size_t kHeaderBytes = 48;
inline constexpr std::size_t kIsoDescriptorBytes = 16;

/// The eight bytes of a control transfer.
struct SetupPacket {
  std::uint8_t request_type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

enum class CommandKind : std::uint8_t { submit, unlink, unknown };

/// A request of the kernel.
struct Command {
  CommandKind kind = CommandKind::unknown;
  std::uint32_t sequence = 0;         ///< names the URB, and its reply
  std::uint8_t endpoint = 0;          ///< address, with 0x80 for IN; 0 and 0x80 are the control endpoint
  std::uint32_t transfer_bytes = 0;   ///< that follow (OUT) or requested at most (IN)
  std::uint32_t start_frame = 0;      ///< of an isochronous URB; goes back as it came
  std::uint32_t iso_packets = 0;      ///< 0: not isochronous
  std::uint32_t unlink_sequence = 0;  ///< the URB to be taken back (unlink)
  SetupPacket setup;                  ///< at the control endpoint
};
Command parseCommand(std::span<const std::uint8_t, kHeaderBytes> bytes);

/// The place of an isochronous packet in the host's buffer, and its result.
struct IsoDescriptor {
  std::uint32_t offset = 0;
  std::uint32_t length = 0;
  std::uint32_t actual_length = 0;
  std::int32_t status = 0;
};
IsoDescriptor parseIsoDescriptor(std::span<const std::uint8_t, kIsoDescriptorBytes> bytes);
void writeIsoDescriptor(const IsoDescriptor& descriptor, std::span<std::uint8_t, kIsoDescriptorBytes> bytes);

/// How a URB ended.
struct SubmitReply {
  std::uint32_t sequence = 0;
  std::int32_t status = 0;          ///< 0 or a negative errno
  std::uint32_t actual_length = 0;  ///< bytes; of an isochronous URB the sum over its packets
  std::uint32_t start_frame = 0;
  std::uint32_t iso_packets = 0;
};
void writeSubmitReply(const SubmitReply& reply, std::span<std::uint8_t, kHeaderBytes> bytes);

/// `status`: -ECONNRESET when the URB was taken back, 0 when it had been answered before.
void writeUnlinkReply(std::uint32_t sequence, std::int32_t status,
                      std::span<std::uint8_t, kHeaderBytes> bytes);

}  // namespace hapticd::test::usbip
