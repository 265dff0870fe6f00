// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/solids/exact_surface.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools {
namespace {

using rt::Vec3;

Vec3 nearestOfSegment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 along = b - a;
  const double length2 = dot(along, along);
  return length2 > 0 ? a + std::clamp(dot(p - a, along) / length2, 0.0, 1.0) * along : a;
}

}  // namespace

Vec3 nearestOfTriangle(const std::array<Vec3, 3>& c, const Vec3& p) {
  const Vec3 normal = cross(c[1] - c[0], c[2] - c[0]);
  const double area2 = dot(normal, normal);
  bool is_above = area2 > 0;
  for (std::size_t i = 0; i < 3 && is_above; ++i)
    is_above = dot(cross(c[(i + 1) % 3] - c[i], p - c[i]), normal) >= 0;
  if (is_above) return p - (dot(p - c[0], normal) / area2) * normal;
  Vec3 best = nearestOfSegment(c[0], c[1], p);
  for (std::size_t i = 1; i < 3; ++i) {
    const Vec3 other = nearestOfSegment(c[i], c[(i + 1) % 3], p);
    if (norm(other - p) < norm(best - p)) best = other;
  }
  return best;
}

ExactPlace ExactSurface::at(const Vec3& place_m) const {
  return at(place_m, tree_.winding(place_m) > 0.5);
}

ExactPlace ExactSurface::at(const Vec3& place_m, bool is_inside) const {
  const double sign = is_inside ? -1 : 1;
  const Vec3 foot_m = nearestOfTriangle(tree_.corners_m(tree_.nearest(place_m).triangle), place_m);
  const double distance_m = norm(place_m - foot_m);
  return {sign * distance_m, foot_m, distance_m > 0 ? (sign / distance_m) * (place_m - foot_m) : Vec3{}};
}

bool ExactSurface::isNearEdge(const Vec3& foot_m, double reach_m) const {
  return std::ranges::any_of(edges_, [&](const Segment& edge) {
    return norm(nearestOfSegment(edge[0], edge[1], foot_m) - foot_m) < reach_m;
  });
}

bool ExactSurface::isAloneFor(const ExactPlace& place, double reach_m) const {
  constexpr double kShare = 0.99;
  const bool is_inside = place.distance_m < 0;
  const Vec3 away = is_inside ? -place.gradient : place.gradient;
  const Vec3 farther_m = place.foot_m + (std::abs(place.distance_m) + reach_m) * away;
  return std::abs(at(farther_m, is_inside).distance_m) >= std::abs(place.distance_m) + kShare * reach_m;
}

}  // namespace hapticd::tools
