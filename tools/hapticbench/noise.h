// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "config/base/error.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::tools {

/// Depth frames whose noise is measured.
struct NoiseSession {
  struct Frame {
    int period = 0;                  ///< which frame period it is of; lost frames leave gaps
    std::vector<std::uint16_t> raw;  ///< drivers::kKinectPixels
  };
  std::vector<Frame> frames;  ///< in the order of their periods
};

/// How many of `recorded` frames are measured when `wanted` are to be, from the first on.
/// Errors: fewer than a measurement takes (kMinFrames).
base::Result<std::size_t> framesOf(const std::filesystem::path& recording, std::size_t recorded, int wanted);

/// The depth frames of a recording in libfreenect's format, by the camera's own counter or, where it has
/// none, by the host's clock. Errors: those of the reader, and fewer frames than a measurement takes
/// (kMinFrames).
base::Result<NoiseSession> readSession(const std::filesystem::path& recording, int frames = 60);

/// Fewest frames that a measurement takes: both halves of a session are compared.
inline constexpr int kMinFrames = 8;

/// A resting wall in front of a synthetic camera, 1.8 m away and turned by 25 degrees about both axes of the
/// image, so that all phases of rounding occur. `shift_raw`: added to every disparity.
NoiseSession madeUpSession(const drivers::SensorNoise& noise, int frames, double shift_raw = 0);

/// A figure's median over all windows, which a few bad windows do not change, and its standard error, from
/// how the windows differ.
struct Estimate {
  double value = 0;
  double spread = 0;          ///< standard deviation between windows, by the median of their distances
  double standard_error = 0;  ///< of `value`
};

/// Residuals of resting surfaces in raw units after subtracting a smooth surface from each window.
struct NoiseStatistics {
  int window_px = 0;
  int windows = 0;        ///< that were measured
  int with_holes = 0;     ///< left out: fewer than kSteadyShare of their pixels are measured in every frame
  int not_smooth = 0;     ///< left out: an edge, or a body with finer shape than a quadratic
  int moving = 0;         ///< left out: their surface moves by more than kMotionRaw during the session
  Estimate temporal_raw;  ///< standard deviation of a pixel over the frames
  Estimate static_raw;    ///< deviation of the static component, common to both halves of the session
  Estimate halves_correlation;     ///< between the means of both halves
  Estimate left_after_8_raw;       ///< deviation of the mean of eight frames in a row
  std::vector<Estimate> in_time;   ///< autocovariance after 0..kTimeLags periods, raw units^2
  std::vector<Estimate> in_space;  ///< after 0..kSpaceLags pixels along rows and columns, raw units^2
};

inline constexpr int kTimeLags = 20;
inline constexpr int kSpaceLags = 16;
inline constexpr double kSteadyShare = 0.8;
inline constexpr double kMotionRaw = 0.25;
/// Sides of the windows in which the fact sheet states its figures, pixels.
inline constexpr int kWindowSides_px[] = {24, 40, 64, 96};

/// Returns the statistics of all adjacent windows of `window_px`. Without a single window that can be
/// measured, all estimates are not a number; a lag that no pair of frames has is not a number either.
NoiseStatistics measureNoise(const NoiseSession& session, int window_px);

/// Correlation of the mean images of two sessions of one scene, each without the smooth surface of its
/// windows: how much of the pattern of one is seen in the other. Sessions of unlike length are allowed.
Estimate patternCorrelation(const NoiseSession& a, const NoiseSession& b, int window_px);

}  // namespace hapticd::tools
