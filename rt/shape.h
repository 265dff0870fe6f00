// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "rt/vec3.h"
#include "rt/words.h"

/// Solid shapes with closed-form signed distances, for virtual fixtures and tissue regions.
namespace hapticd::rt {

enum class ShapeKind : std::uint8_t { plane, sphere, box, capsule, cone };
constexpr auto wordsOf(ShapeKind) {
  return words<ShapeKind>("plane", "sphere", "box", "capsule", "cone");
}

/// A solid shape; the members that its kind does not name are ignored. All of them are convex.
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  /// plane: a point of it; sphere, box: the centre; capsule: the first end; cone: the tip.
  Vec3 position_m_in_world{};
  /// plane: unit normal, the solid is behind it; capsule: unit vector to the second end; cone: unit vector
  /// from the tip into the cone.
  Vec3 axis_in_world{0, 0, 1};
  double length_m = 0;        ///< capsule: distance of its ends, >= 0
  double radius_m = 0;        ///< sphere, capsule: > 0
  double half_angle_rad = 0;  ///< cone: between axis and side, 0 < angle < pi / 2
  /// box: its axes as columns of a rotation matrix, row by row.
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec3 half_size_m{};  ///< box: along its axes, > 0
};

/// Signed distance of a place from the boundary of a solid, positive outside, and its gradient.
struct SignedDistance {
  double distance_m = 0;
  Vec3 normal_in_world{0, 0, 1};  ///< unit vector; where the distance has a kink, one of its directions
};

/// Returns the signed distance of `p_m_in_world` (finite) from `shape`.  RT: safe.
SignedDistance distanceFrom(const Shape& shape, const Vec3& p_m_in_world) noexcept;

}  // namespace hapticd::rt
