// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/touch.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "rt/fixtures/fixture.h"

namespace hapticd::tools {

rt::Vec3 Touch::mean_m_in_world() const {
  rt::Vec3 sum;
  for (const rt::Vec3& reading : readings_m_) sum += reading;
  return (1.0 / static_cast<double>(readings_m_.size())) * sum;
}

double Touch::spread_m() const {
  const rt::Vec3 mean = mean_m_in_world();
  double farthest_m = 0;
  for (const rt::Vec3& reading : readings_m_) farthest_m = std::max(farthest_m, rt::norm(reading - mean));
  return farthest_m;
}

namespace {

using base::Error;
using rt::Vec3;
using Points = std::vector<Vec3>;

constexpr double kToleranceStep = 1.25;

double distanceToSegment_m(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double squared = dot(along, along);
  const double share = squared > 0 ? std::clamp(dot(p - a, along) / squared, 0.0, 1.0) : 0;
  return norm(p - a - share * along);
}

double lengthOf(std::span<const Vec3> points_m) {
  double length_m = 0;
  for (std::size_t i = 1; i < points_m.size(); ++i) length_m += norm(points_m[i] - points_m[i - 1]);
  return length_m;
}

/// The readings without those that are nearer than a step to the one before, so that a hand that rests adds
/// nothing to the length.
Points withoutTrembling(std::span<const Vec3> readings_m) {
  Points kept;
  for (const Vec3& reading : readings_m) {
    if (kept.empty() || norm(reading - kept.back()) >= kStrokeStep_m) kept.push_back(reading);
  }
  return kept;
}

/// Points at equal distances along a polyline, about a step apart, with both of its ends.
Points resampled(std::span<const Vec3> points_m) {
  const double length_m = lengthOf(points_m);
  const auto steps = std::max<std::size_t>(1, static_cast<std::size_t>(length_m / kStrokeStep_m));
  const double step_m = length_m / static_cast<double>(steps);
  Points even{points_m.front()};
  double passed_m = 0;
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    const double piece_m = norm(points_m[i] - points_m[i - 1]);
    while (even.size() < steps) {
      const double along_m = step_m * static_cast<double>(even.size()) - passed_m;
      if (along_m > piece_m) break;
      even.push_back(points_m[i - 1] + (along_m / piece_m) * (points_m[i] - points_m[i - 1]));
    }
    passed_m += piece_m;
  }
  even.push_back(points_m.back());
  return even;
}

Points simplified(const Points& points_m, double tolerance_m) {
  std::vector<bool> kept(points_m.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, points_m.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double farthest_m = tolerance_m;
    std::size_t farthest = first;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance_m = distanceToSegment_m(points_m[i], points_m[first], points_m[last]);
      if (distance_m <= farthest_m) continue;
      farthest_m = distance_m;
      farthest = i;
    }
    if (farthest == first) continue;
    kept[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  Points corners;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    if (kept[i]) corners.push_back(points_m[i]);
  }
  return corners;
}

double distanceToPath_m(const Vec3& p, const Points& path_m) {
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < path_m.size(); ++i)
    least_m = std::min(least_m, distanceToSegment_m(p, path_m[i - 1], path_m[i]));
  return least_m;
}

}  // namespace

base::Result<StrokePath> pathOf(std::span<const Vec3> readings_m, double tolerance_m) {
  if (!std::ranges::all_of(readings_m, rt::isFinite))
    return std::unexpected(Error{"path", "a position of the handle is not finite", "stroke it again"});
  const Points moving = withoutTrembling(readings_m);
  StrokePath path;
  path.length_m = lengthOf(moving);
  if (path.length_m < kMinStroke_m) {
    return std::unexpected(Error{"path",
                                 fmt::format("the stroke is {:.1f} mm long, at least {:.0f} mm are needed",
                                             1000 * path.length_m, 1000 * kMinStroke_m),
                                 "move the handle along the path while the stroke is recorded"});
  }
  const Points even = resampled(moving);
  path.tolerance_m = tolerance_m;
  path.points_m = simplified(even, path.tolerance_m);
  while (path.points_m.size() > rt::kMaxPathPoints) {
    path.tolerance_m *= kToleranceStep;
    path.points_m = simplified(even, path.tolerance_m);
  }
  std::vector<double> distances_m;
  for (const Vec3& reading : readings_m) distances_m.push_back(distanceToPath_m(reading, path.points_m));
  path.residuals = residualsOf(distances_m);
  return path;
}

}  // namespace hapticd::tools
