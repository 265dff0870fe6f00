// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace hapticd::drivers {

static_assert(std::endian::native == std::endian::little, "messages are little-endian");

using Bytes = std::span<const std::byte>;

/// Returns the little-endian number at `offset`, which must lie within `bytes`.
template <typename Number>
Number numberAt(Bytes bytes, std::size_t offset) {
  static_assert(std::is_arithmetic_v<Number>);
  Number number{};
  std::memcpy(&number, bytes.subspan(offset, sizeof number).data(), sizeof number);
  return number;
}

/// Appends a number in little-endian order.
template <typename Number>
void append(std::vector<std::byte>& bytes, Number number) {
  static_assert(std::is_arithmetic_v<Number>);
  const std::size_t offset = bytes.size();
  bytes.resize(offset + sizeof number);
  std::memcpy(bytes.data() + offset, &number, sizeof number);
}

}  // namespace hapticd::drivers
