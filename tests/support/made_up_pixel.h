// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace hapticd::test {

/// Returns the pixel (index) of a synthetic frame: all values 0..2047 occur, and no two frames below 100 are
/// equal.
constexpr std::uint16_t madeUpPixel(std::uint32_t frame, std::size_t pixel) {
  return static_cast<std::uint16_t>((pixel * 7 + std::size_t{frame} * 131) % 2048);
}

}  // namespace hapticd::test
