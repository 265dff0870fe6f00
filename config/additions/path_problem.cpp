// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "config/additions/addition_checks.h"
#include "config/base/value_text.h"
#include "rt/fixtures/fixture.h"

namespace hapticd::config {
namespace {

using rt::Vec3;

constexpr double kSharpestTurn_deg = 175;
constexpr double kCrossingDistance_m = 0.001;

double angleBetween_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

/// Returns the distance of two segments of at least kMinPointDistance_m (Ericson, Real-Time Collision
/// Detection, section 5.1.9).
double segmentDistance_m(const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2) {
  const Vec3 d1 = q1 - p1;
  const Vec3 d2 = q2 - p2;
  const Vec3 r = p1 - p2;
  const double a = dot(d1, d1);
  const double e = dot(d2, d2);
  const double f = dot(d2, r);
  const double c = dot(d1, r);
  const double b = dot(d1, d2);
  const double denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0;
  double t = (b * s + f) / e;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - c) / a, 0.0, 1.0);
  }
  return norm((p1 + s * d1) - (p2 + t * d2));
}

/// `closed`: the last point is the first one.
std::optional<PathProblem> crossing(std::span<const Vec3> points_m, bool closed) {
  const std::size_t segments = points_m.size() - 1;
  std::vector<double> along_m{0};  // length of the path up to each point
  for (std::size_t i = 0; i < segments; ++i)
    along_m.push_back(along_m.back() + norm(points_m[i + 1] - points_m[i]));
  for (std::size_t i = 0; i + 2 < segments; ++i) {
    for (std::size_t j = i + 2; j < segments; ++j) {
      const double forwards_m = along_m[j] - along_m[i + 1];
      const double around_m = along_m[segments] - along_m[j + 1] + along_m[i];
      const double gap_m = closed ? std::min(forwards_m, around_m) : forwards_m;
      // Near each other along the path, segments are near each other in space too without any crossing.
      const double least_m = std::min(kCrossingDistance_m, gap_m / 2);
      const double distance_m = segmentDistance_m(points_m[i], points_m[i + 1], points_m[j], points_m[j + 1]);
      if (distance_m >= least_m) continue;
      return PathProblem{
          fmt::format("the path crosses itself: the segments from point {} to {} and from {} to {} are "
                      "{:.2g} m apart",
                      i + 1, i + 2, j + 1, j + 2, distance_m),
          i == 0 && j + 1 == segments && !closed
              ? "to make it a closed path, end it in its first point; otherwise move the points apart by "
                "more "
                "than 0.001 m, or set allow_crossing to true"
              : "move the points apart by more than 0.001 m, or set allow_crossing to true"};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<PathProblem> pathProblem(std::span<const Vec3> given_m, bool allow_crossing) {
  const bool closed = rt::isClosedPath(given_m);
  std::vector<Vec3> points_m(given_m.begin(), given_m.end());
  if (closed) points_m.back() = points_m.front();
  for (std::size_t i = 0; i + 1 < points_m.size(); ++i) {
    const double distance_m = norm(points_m[i + 1] - points_m[i]);
    if (distance_m >= rt::kMinPointDistance_m) continue;
    return PathProblem{fmt::format("points {} and {} are {:.2g} m apart", i + 1, i + 2, distance_m),
                       fmt::format("delete one of the two, or move them at least {} m apart",
                                   base::numberText(rt::kMinPointDistance_m))};
  }
  for (std::size_t i = 1; i + (closed ? 0 : 1) < points_m.size(); ++i) {
    const Vec3 onward = i + 1 < points_m.size() ? points_m[i + 1] - points_m[i] : points_m[1] - points_m[0];
    const double turn_deg = angleBetween_deg(points_m[i] - points_m[i - 1], onward);
    if (turn_deg <= kSharpestTurn_deg) continue;
    return PathProblem{fmt::format("the path turns by {:.1f} degrees at point {}", turn_deg, i + 1),
                       fmt::format("add a point beside it, so that no turn exceeds {} degrees",
                                   base::numberText(kSharpestTurn_deg))};
  }
  return allow_crossing ? std::nullopt : crossing(points_m, closed);
}

}  // namespace hapticd::config
