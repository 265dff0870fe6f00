// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/cache_line.h"
#include "rt/triple_buffer.h"

namespace hapticd::rt {

/// The Kinect v1's depth image: 640 columns u (left to right) and 480 rows v (top to bottom).
inline constexpr int kFrameWidth = 640;
inline constexpr int kFrameHeight = 480;
inline constexpr std::size_t kFramePixels = std::size_t{kFrameWidth} * kFrameHeight;

/// Raw disparities are 11 bits wide, 0..2046; 2047 means that there is no measurement.
inline constexpr int kRawValues = 2048;
inline constexpr std::uint16_t kRawNoMeasurement = 2047;

/// One image of raw disparities as the camera delivers it, with its arrival time.
struct DepthFrame {
  alignas(kCacheLine) std::uint16_t raw[kFramePixels];  ///< row by row; values above 2047 are damaged data
  std::uint64_t sequence;                               ///< 1 for the first frame since the camera started
  std::int64_t arrival_ns;                              ///< CLOCK_MONOTONIC when the last byte arrived
  std::uint32_t device_ticks;  ///< the camera's own counter (60 MHz); 0 if it has none
};

/// Carries frames from the camera thread (writer) to the scene thread (reader).
using FrameChannel = TripleBuffer<DepthFrame>;

}  // namespace hapticd::rt
