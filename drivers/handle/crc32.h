#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hapticd::drivers {

/// CRC-32 with a reflected polynomial; start and final exclusive-or 0xFFFFFFFF.  Progress: wait-free.  RT:
/// safe. 0xEDB88320: IEEE 802.3, as of zlib; 0x82F63B78: Castagnoli, RFC 3720.
template <std::uint32_t kReflectedPolynomial>
std::uint32_t crc32Of(std::span<const std::byte> bytes) noexcept {
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      std::uint32_t remainder = i;
      for (int bit = 0; bit < 8; ++bit) {
        remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? kReflectedPolynomial : 0);
      }
      table[i] = remainder;
    }
    return table;
  }();
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::byte byte : bytes) {
    crc = (crc >> 8) ^ kTable[(crc ^ std::to_integer<std::uint32_t>(byte)) & 255];
  }
  return ~crc;
}

}  // namespace hapticd::drivers
