// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/camera/kinect_image.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Returns true if some pixel is wider than 11 bits, which no sensor sends: the whole frame is then damaged.
/// A single OR over all pixels without branches, which the compiler vectorises.
inline bool hasDamagedPixels(std::span<const std::uint16_t> raw) noexcept {
  std::uint32_t bits = 0;
  for (const std::uint16_t value : raw) bits |= value;
  return bits >= kKinectRawValues;
}

/// Returns the number of pixels wider than 11 bits, for the report on a damaged frame.
inline std::size_t countDamagedPixels(std::span<const std::uint16_t> raw) noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(raw, [](std::uint16_t value) { return value >= kKinectRawValues; }));
}

}  // namespace hapticd::drivers
