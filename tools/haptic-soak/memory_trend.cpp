// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/memory_trend.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr double kWarmUpShare = 0.2;
constexpr double kShortestWarmUp_s = 3;

std::span<const MemoryPoint> afterWarmUp(std::span<const MemoryPoint> points) {
  if (points.empty()) return points;
  const double length_s = points.back().time_s - points.front().time_s;
  const double begin_s = points.front().time_s + std::max(kWarmUpShare * length_s, kShortestWarmUp_s);
  const auto first =
      std::ranges::find_if(points, [begin_s](const MemoryPoint& p) { return p.time_s >= begin_s; });
  return points.subspan(static_cast<std::size_t>(first - points.begin()));
}

/// Returns the slopes between all pairs of points, sorted.
std::vector<double> slopesBetween(std::span<const MemoryPoint> points) {
  std::vector<double> slopes;
  for (std::size_t later = 1; later < points.size(); ++later) {
    for (std::size_t earlier = 0; earlier < later; ++earlier) {
      const double time_s = points[later].time_s - points[earlier].time_s;
      if (time_s <= 0) continue;
      slopes.push_back((points[later].resident_kb - points[earlier].resident_kb) / time_s);
    }
  }
  std::ranges::sort(slopes);
  return slopes;
}

}  // namespace

MemoryTrend memoryTrend(std::span<const MemoryPoint> all) {
  const auto points = afterWarmUp(all);
  const std::vector<double> slopes = slopesBetween(points);
  if (points.size() < 3 || slopes.empty()) return {};
  const double n = static_cast<double>(points.size());
  // Kendall's S has this standard deviation under independent scatter; a step of one rank changes S by 2, so
  // that many ranks below the median are two of them.
  const double ranks = std::sqrt(n * (n - 1) * (2 * n + 5) / 18);
  const std::size_t middle = slopes.size() / 2;
  const std::size_t low = middle - std::min(middle, static_cast<std::size_t>(std::ceil(ranks)));
  const double span_s = points.back().time_s - points.front().time_s;
  return {slopes[middle] * span_s, (slopes[middle] - slopes[low]) * span_s};
}

double allowedGrowth_kb(double length_s) {
  constexpr double kAllowed_kb = 1024;
  constexpr double kPer_s = 600;
  return kAllowed_kb * std::max(1.0, length_s / kPer_s);
}

}  // namespace hapticd::tools
