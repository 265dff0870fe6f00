// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// The depth image of a Kinect v1: 640 columns u (left to right) and 480 rows v (top to bottom). Its rows
/// need no padding, so that the pixels of a frame are contiguous.
inline constexpr int kKinectWidth = 640;
inline constexpr int kKinectHeight = 480;
inline constexpr std::size_t kKinectPixels = std::size_t{kKinectWidth} * kKinectHeight;

/// Its raw disparities have 11 bits: 0..2046, rising with distance; 2047 means that there is no measurement.
inline constexpr int kKinectRawValues = 2048;
inline constexpr std::uint16_t kKinectNoMeasurement = 2047;

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
