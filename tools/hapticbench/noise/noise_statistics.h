// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/hapticbench/noise/noise_session.h"

namespace hapticd::tools {

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

/// Returns the statistics for people, one line per window size.
std::string noiseText(const std::string& source, const std::vector<NoiseStatistics>& statistics);

/// Returns the statistics as JSON, with the autocovariances; figures that could not be measured are null.
std::string noiseJson(const std::string& source, std::size_t frames,
                      const std::vector<NoiseStatistics>& statistics);

}  // namespace hapticd::tools
