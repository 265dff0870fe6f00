// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/base/cache_line.h"
#include "rt/base/parameters.h"
#include "rt/channels/triple_buffer.h"

namespace hapticd::rt {

/// Largest number of 32-bit lanes in a vector register of any supported machine. Arrays that kernels read or
/// write in whole vectors end with this many spare elements.
inline constexpr std::size_t kVectorPadding = 64;

/// Rows of images are padded to a multiple of this many pixels, so that no vector or tile crosses their end.
inline constexpr int kRowAlignment_px = 64;

/// Returns the distance between the rows of an image in pixels.
constexpr int strideOf(int width_px) noexcept {
  return (width_px + kRowAlignment_px - 1) / kRowAlignment_px * kRowAlignment_px;
}

/// Largest size of a frame of any camera.
inline constexpr int kMaxFrameWidth = 1280;
inline constexpr int kMaxFrameHeight = 800;
inline constexpr std::size_t kMaxFramePixels = std::size_t{kMaxFrameWidth} * kMaxFrameHeight;

/// One image of raw values as the camera delivers it, with its arrival time and the camera that made it.
struct DepthFrame {
  /// camera.height_px rows, strideOf(camera.width_px) apart; the padding holds camera.raw_no_measurement.
  alignas(kCacheLine) std::uint16_t raw[kMaxFramePixels];
  DepthModelParameters camera;   ///< set by the driver before the first frame, and when the camera changes
  std::uint64_t sequence;        ///< 1 for the first frame since the camera started
  std::int64_t arrival_ns;       ///< CLOCK_MONOTONIC when the last byte arrived
  std::int64_t exposure_ns = 0;  ///< CLOCK_MONOTONIC at mid-exposure; 0: not known
  std::uint32_t device_ticks;    ///< the camera's own counter; 0 if it has none

  /// Returns the number of values in `raw`, with the padding of the rows.
  std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(strideOf(camera.width_px)) * static_cast<std::size_t>(camera.height_px);
  }
  std::span<std::uint16_t> image() noexcept { return {raw, pixels()}; }
  std::span<const std::uint16_t> image() const noexcept { return {raw, pixels()}; }
};

/// Carries frames from the camera thread (writer) to the scene thread (reader).
using FrameChannel = TripleBuffer<DepthFrame>;

}  // namespace hapticd::rt
