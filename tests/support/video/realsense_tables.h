// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hapticd::test {

/// Writes a number at an offset of a message, which must be long enough.
template <typename Number>
void put(std::vector<std::byte>& bytes, std::size_t offset, Number number) {
  const auto* const first = reinterpret_cast<const std::byte*>(&number);
  for (std::size_t i = 0; i < sizeof number; ++i) bytes.at(offset + i) = first[i];
}

/// Computes the CRC-32 of IEEE 802.3 bit by bit.
std::uint32_t bitwiseCrc(const std::vector<std::byte>& bytes, std::size_t first);

/// Table 25 of a camera with a baseline of 50 mm and, for 848 x 480, f = 425 px and the centre (420, 238).
std::vector<std::byte> coefficientsTable();
/// Sets the checksum of a table whose content has changed.
void seal(std::vector<std::byte>& table);

/// The reply to RECPARAMSGET with 848 x 480 (f = 424 px, centre (422, 239)) and 1280 x 720.
std::vector<std::byte> depthModes();

/// The data of GVD with the firmware 5.15.1.0 and the serial number 012345abcdef.
std::vector<std::byte> deviceData();

/// Wraps data in a reply of the hardware monitor.
std::vector<std::byte> monitorReply(std::uint32_t command, const std::vector<std::byte>& data);

}  // namespace hapticd::test
