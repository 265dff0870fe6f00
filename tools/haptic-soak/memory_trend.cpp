#include "tools/haptic-soak/memory_trend.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

MemoryTrend memoryTrend(std::span<const MemoryPoint> all) {
  const auto points = afterWarmUp(all);
  if (points.size() < 3) return {};
  const double n = static_cast<double>(points.size());
  double mean_s = 0, mean_kb = 0;
  for (const MemoryPoint& point : points) {
    mean_s += point.time_s / n;
    mean_kb += point.resident_kb / n;
  }
  double times = 0, both = 0;
  for (const MemoryPoint& point : points) {
    times += (point.time_s - mean_s) * (point.time_s - mean_s);
    both += (point.time_s - mean_s) * (point.resident_kb - mean_kb);
  }
  if (times <= 0) return {};
  const double slope = both / times;
  double residuals = 0;
  for (const MemoryPoint& point : points) {
    const double residual = point.resident_kb - mean_kb - slope * (point.time_s - mean_s);
    residuals += residual * residual;
  }
  const double span_s = points.back().time_s - points.front().time_s;
  return {slope * span_s, 2 * std::sqrt(residuals / (n - 2) / times) * span_s};
}

double allowedGrowth_kb(double length_s) {
  constexpr double kAllowed_kb = 1024;
  constexpr double kPer_s = 600;
  return kAllowed_kb * std::max(1.0, length_s / kPer_s);
}

}  // namespace hapticd::tools
