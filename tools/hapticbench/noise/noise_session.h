// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "config/error.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {

/// Depth frames whose noise is measured.
struct NoiseSession {
  struct Frame {
    int period = 0;                  ///< which frame period it is of; lost frames leave gaps
    std::vector<std::uint16_t> raw;  ///< drivers::kKinectPixels
  };
  std::vector<Frame> frames;  ///< in the order of their periods
};

/// The frames of a recording to measure.
struct SessionPart {
  int first = 0;
  int frames = 60;
};

/// The frames of a part that a recording has: begin is included, end is not.
struct FrameRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Returns which of `recorded` frames belong to `part`.
/// Errors: fewer than a measurement takes (kFewestFrames).
config::Result<FrameRange> framesOf(const std::filesystem::path& recording, std::size_t recorded,
                                    const SessionPart& part);

/// The depth frames of a recording in libfreenect's format, by the camera's own counter or, where it has
/// none, by the host's clock. Errors: those of the reader, and fewer frames than a measurement takes
/// (kFewestFrames).
config::Result<NoiseSession> readSession(const std::filesystem::path& recording, const SessionPart& part);

/// Fewest frames that a measurement takes: both halves of a session are compared.
inline constexpr int kFewestFrames = 8;

/// A resting wall in front of a synthetic camera, 1.8 m away and turned by 25 degrees about both axes of the
/// image, so that all phases of rounding occur. `shift_raw`: added to every disparity.
NoiseSession madeUpSession(const drivers::SensorNoise& noise, int frames, double shift_raw = 0);

}  // namespace hapticd::tools
