#pragma once

#include <span>

namespace hapticd::tools {

/// Memory in use at a time.
struct MemoryPoint {
  double time_s = 0;
  double resident_kb = 0;
};

/// A straight line through memory in use over time.
struct MemoryTrend {
  double growth_kb = 0;  ///< from the line's begin to its end
  double noise_kb = 0;   ///< the points' scatter lets the growth be that much off, with 95 % confidence
};

/// Least squares over the points after the warm-up, the first fifth of the time and at least 3 s; zero for
/// fewer than three of them.
MemoryTrend memoryTrend(std::span<const MemoryPoint> points);

/// The most that the line may grow beyond its noise over a run of that length: 1 MB, or 1 MB per ten minutes
/// in a longer one.
double allowedGrowth_kb(double length_s);

}  // namespace hapticd::tools
