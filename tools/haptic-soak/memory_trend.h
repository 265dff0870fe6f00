// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace hapticd::tools {

/// Memory in use at a time.
struct MemoryPoint {
  double time_s = 0;
  double resident_kb = 0;
};

/// How memory in use grows with time.
struct MemoryTrend {
  double growth_kb = 0;  ///< growth over the observed time
  double noise_kb = 0;   ///< lower limit of the growth, at 97.5 % confidence, is this much less
};

/// The median of the slopes between all pairs of points (P. K. Sen, "Estimates of the regression coefficient
/// based on Kendall's tau", 1968), so that what is taken once and kept is no growth and what is taken again
/// and again is. Over the points after the warm-up, the first fifth of the time and at least 3 s; zero for
/// fewer than three of them. Takes time and memory by the square of the number of points.
MemoryTrend memoryTrend(std::span<const MemoryPoint> points);

/// Returns the allowed growth of memory beyond its noise over a run of that length: 1 MB, or 1 MB per ten
/// minutes in a longer one.
double allowedGrowth_kb(double length_s);

}  // namespace hapticd::tools
