// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/touch.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
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

/// Of two points of a path: rounding, as of a motion into another frame, takes none below what is allowed.
constexpr double kLeastGap_m = 1.001 * rt::kMinPointDistance_m;

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

double distanceToPath_m(const Vec3& p, const Points& path_m) {
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < path_m.size(); ++i)
    least_m = std::min(least_m, distanceToSegment_m(p, path_m[i - 1], path_m[i]));
  return least_m;
}

}  // namespace

SimplifiedPath simplifiedPath(std::span<const Vec3> points_m, double tolerance_m) {
  /// A segment of the path, for the points from `first` to `last`.
  struct Piece {
    std::size_t first, last;
    double deviation_m = 0;                  // of the point that is farthest from the segment
    std::optional<std::size_t> corner = {};  // where it may be divided
  };
  const auto piece = [&](std::size_t first, std::size_t last) {
    Piece made{first, last};
    double farthest_m = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance_m = distanceToSegment_m(points_m[i], points_m[first], points_m[last]);
      made.deviation_m = std::max(made.deviation_m, distance_m);
      const double gap_m = std::min(norm(points_m[i] - points_m[first]), norm(points_m[last] - points_m[i]));
      if (distance_m <= farthest_m || gap_m < kLeastGap_m) continue;
      farthest_m = distance_m;
      made.corner = i;
    }
    return made;
  };
  std::vector<Piece> pieces{piece(0, points_m.size() - 1)};
  while (pieces.size() + 1 < rt::kMaxPathPoints) {
    const auto worst = std::ranges::max_element(
        pieces, {}, [](const Piece& each) { return each.corner ? each.deviation_m : 0; });
    if (!worst->corner || worst->deviation_m <= tolerance_m) break;
    const Piece behind = piece(*worst->corner, worst->last);
    *worst = piece(worst->first, *worst->corner);
    pieces.insert(worst + 1, behind);
  }
  SimplifiedPath path{{points_m.front()}};
  for (const Piece& each : pieces) {
    path.points_m.push_back(points_m[each.last]);
    path.deviation_m = std::max(path.deviation_m, each.deviation_m);
  }
  return path;
}

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
  SimplifiedPath simplified = simplifiedPath(even, tolerance_m);
  path.tolerance_m = std::max(tolerance_m, simplified.deviation_m);
  path.points_m = std::move(simplified.points_m);
  std::vector<double> distances_m;
  for (const Vec3& reading : readings_m) distances_m.push_back(distanceToPath_m(reading, path.points_m));
  path.residuals = residualsOf(distances_m);
  return path;
}

}  // namespace hapticd::tools
