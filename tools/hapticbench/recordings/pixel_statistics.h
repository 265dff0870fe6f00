// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "tools/hapticbench/bench_scene.h"

namespace hapticd::tools {

/// Statistics of a pixel over a session, raw units.
struct PixelStatistics {
  float mean = 0;
  float deviation = 0;         ///< standard deviation over the frames
  float drift = 0;             ///< mean of the second half less that of the first
  std::uint16_t valid = 0;     ///< frames with a measurement
  std::uint16_t farthest = 0;  ///< the raw value that a fifth of its measurements reach or exceed
};

/// Returns the statistics of drivers::kKinectPixels pixels, row by row.
std::vector<PixelStatistics> pixelStatistics(const BenchSequence& session);

/// True where the pixel saw a surface at rest: nearly always measured, and within noise of its mean.
bool rests(const PixelStatistics& pixel, std::size_t frames);

}  // namespace hapticd::tools
