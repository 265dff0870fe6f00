// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

/// Parts of the strict reader of MCAP files.
namespace hapticd::test::strict {

using Bytes = std::string_view;

inline constexpr Bytes kMagicBytes{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kHeadBytes = 9;

// opcodes of the specification
enum : unsigned {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

/// Computes the CRC-32 of IEEE 802.3, byte by byte.
inline std::uint32_t crc32(Bytes bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> remainders{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t remainder = i;
      for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ (remainder % 2 * 0xEDB88320U);
      remainders[i] = remainder;
    }
    return remainders;
  }();
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char c : bytes) crc = table[(crc ^ static_cast<unsigned char>(c)) & 255] ^ (crc >> 8);
  return ~crc;
}

/// Reads fields one by one; a missing one makes it bad.
class Fields {
 public:
  explicit Fields(Bytes bytes) : rest_(bytes) {}

  std::uint64_t number(std::size_t bytes) {
    const Bytes taken = take(bytes);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      value |= std::uint64_t{static_cast<unsigned char>(taken[i])} << (8 * i);
    }
    return value;
  }
  std::uint16_t id() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t small() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t large() { return number(8); }
  Bytes text() { return take(number(4)); }
  Bytes take(std::uint64_t bytes) {
    if (bytes > rest_.size()) {
      bad_ = true;
      bytes = rest_.size();
    }
    const Bytes taken = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return taken;
  }
  bool more() const { return !rest_.empty() && !bad_; }
  bool bad() const { return bad_; }
  /// Returns true if everything was present and nothing else.
  bool done() const { return !bad_ && rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

 private:
  Bytes rest_;
  bool bad_ = false;
};

}  // namespace hapticd::test::strict
