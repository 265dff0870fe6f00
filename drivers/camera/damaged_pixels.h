// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// True when a pixel is wider than 11 bits, which no sensor sends: such a frame is damaged as a whole. One
/// pass of OR without branches, which the compiler turns into vector instructions.
inline bool hasDamagedPixels(const std::uint16_t (&raw)[rt::kFramePixels]) noexcept {
  std::uint32_t bits = 0;
  for (const std::uint16_t value : raw) bits |= value;
  return bits >= rt::kRawValues;
}

/// How many pixels are wider than 11 bits; for the report on a frame that has any.
inline std::size_t countDamagedPixels(const std::uint16_t (&raw)[rt::kFramePixels]) noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(raw, [](std::uint16_t value) { return value >= rt::kRawValues; }));
}

}  // namespace hapticd::drivers
