// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/camera_disparity.h"

namespace hapticd::tools {

/// Statistics of a pixel over a session, in raw disparities of its camera.
struct PixelStatistics {
  float mean = 0;
  float deviation = 0;      ///< standard deviation over the frames
  float drift = 0;          ///< mean of the second half less that of the first
  std::uint16_t valid = 0;  ///< frames with a measurement
  float farthest = 0;       ///< a fifth of its measurements are as far or farther
  float noise_scale = 1;    ///< the camera's noise at the mean relative to a Kinect's
  float drift_noise = 0;    ///< standard deviation of `drift` by the noise that the camera states
};

/// Returns the statistics of all pixels, in the order of a frame's image.
std::vector<PixelStatistics> pixelStatistics(const BenchSequence& session, const CameraDisparity& camera);

/// True where the pixel saw a surface at rest: nearly always measured, and within noise of its mean.
bool rests(const PixelStatistics& pixel, std::size_t frames);

}  // namespace hapticd::tools
