// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

namespace hapticd::test::uvc {

using Bytes = std::vector<std::uint8_t>;

/// Appends numbers in the byte order of USB and of the cameras' tables: little-endian.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& bytes) : bytes_(bytes) {}

  ByteWriter& u8(std::uint8_t value) {
    bytes_.push_back(value);
    return *this;
  }
  ByteWriter& u16(std::uint16_t value) { return number(value, 2); }
  ByteWriter& u32(std::uint32_t value) { return number(value, 4); }
  ByteWriter& i32(std::int32_t value) { return number(std::bit_cast<std::uint32_t>(value), 4); }
  ByteWriter& f32(float value) { return number(std::bit_cast<std::uint32_t>(value), 4); }
  ByteWriter& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  ByteWriter& append(std::span<const std::uint8_t> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }

 private:
  ByteWriter& number(std::uint32_t value, int count) {
    for (int byte = 0; byte < count; ++byte) u8(static_cast<std::uint8_t>(value >> 8 * byte & 0xffU));
    return *this;
  }

  Bytes& bytes_;
};

/// A little-endian number of `bytes`; `at` and the number lie within them.
inline std::uint16_t get16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}
inline std::uint32_t get32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return get16(bytes, at) | std::uint32_t{get16(bytes, at + 2)} << 16;
}
inline void put16(std::span<std::uint8_t> bytes, std::size_t at, std::uint16_t value) {
  bytes[at] = static_cast<std::uint8_t>(value & 0xff);
  bytes[at + 1] = static_cast<std::uint8_t>(value >> 8);
}
inline void put32(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t value) {
  put16(bytes, at, static_cast<std::uint16_t>(value & 0xffff));
  put16(bytes, at + 2, static_cast<std::uint16_t>(value >> 16));
}

}  // namespace hapticd::test::uvc
