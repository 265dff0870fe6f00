// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "rt/base/vec3.h"

namespace hapticd::tools {

/// `v` at length 1; `v` is not zero.
inline rt::Vec3 unitOf(const rt::Vec3& v) noexcept {
  return (1 / norm(v)) * v;
}

/// `v` turned about the direction of `rotation_rad` by its length, right-handed.
inline rt::Vec3 turned(const rt::Vec3& v, const rt::Vec3& rotation_rad) noexcept {
  const double angle = norm(rotation_rad);
  if (angle == 0) return v;
  const rt::Vec3 axis = (1 / angle) * rotation_rad;
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

/// A frame of its own inside another one: its origin and its three axes, right-handed unit vectors, in that
/// other frame. Thread: any.
struct RigidFrame {
  rt::Vec3 origin_m{};
  rt::Vec3 x{1, 0, 0};
  rt::Vec3 y{0, 1, 0};
  rt::Vec3 z{0, 0, 1};

  rt::Vec3 directionOut(const rt::Vec3& inside) const noexcept {
    return inside.x * x + inside.y * y + inside.z * z;
  }
  rt::Vec3 positionOut(const rt::Vec3& inside_m) const noexcept { return origin_m + directionOut(inside_m); }
  rt::Vec3 directionIn(const rt::Vec3& outside) const noexcept {
    return {dot(outside, x), dot(outside, y), dot(outside, z)};
  }
  rt::Vec3 positionIn(const rt::Vec3& outside_m) const noexcept { return directionIn(outside_m - origin_m); }

  /// Turned about the origin of the outer frame, then moved.
  RigidFrame moved(const rt::Vec3& rotation_rad, const rt::Vec3& shift_m) const noexcept {
    return {turned(origin_m, rotation_rad) + shift_m, turned(x, rotation_rad), turned(y, rotation_rad),
            turned(z, rotation_rad)};
  }
};

}  // namespace hapticd::tools
