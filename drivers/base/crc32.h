// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace hapticd::drivers {

/// Remainders of each byte followed by 0 to 7 zero bytes, for processing eight bytes at a time.
template <std::uint32_t kReflectedPolynomial>
inline constexpr auto kCrc32Tables = [] {
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t remainder = i;
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? kReflectedPolynomial : 0);
    }
    tables[0][i] = remainder;
  }
  for (std::size_t zeros = 1; zeros < tables.size(); ++zeros) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t shorter = tables[zeros - 1][i];
      tables[zeros][i] = (shorter >> 8) ^ tables[0][shorter & 255];
    }
  }
  return tables;
}();

/// Computes the CRC-32 with a reflected polynomial; initial value and final exclusive-or are 0xFFFFFFFF.
/// Polynomial 0xEDB88320: IEEE 802.3, as in zlib; 0x82F63B78: Castagnoli, RFC 3720. `before`: the CRC of the
/// preceding bytes.
/// Progress: wait-free.  RT: safe.
template <std::uint32_t kReflectedPolynomial>
std::uint32_t crc32Of(std::span<const std::byte> bytes, std::uint32_t before = 0) noexcept {
  static_assert(std::endian::native == std::endian::little, "words are read in the order of the bits");
  const auto& tables = kCrc32Tables<kReflectedPolynomial>;
  std::uint32_t crc = ~before;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    std::uint32_t low = 0, high = 0;
    std::memcpy(&low, bytes.data(), sizeof low);
    std::memcpy(&high, bytes.data() + sizeof low, sizeof high);
    low ^= crc;
    crc = tables[7][low & 255] ^ tables[6][(low >> 8) & 255] ^ tables[5][(low >> 16) & 255] ^
          tables[4][low >> 24] ^ tables[3][high & 255] ^ tables[2][(high >> 8) & 255] ^
          tables[1][(high >> 16) & 255] ^ tables[0][high >> 24];
  }
  for (const std::byte byte : bytes) {
    crc = (crc >> 8) ^ tables[0][(crc ^ std::to_integer<std::uint32_t>(byte)) & 255];
  }
  return ~crc;
}

}  // namespace hapticd::drivers
