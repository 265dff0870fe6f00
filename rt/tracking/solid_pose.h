// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/base/rotation.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Place and orientation of a solid in an outer frame, here always the frame of the points that it is
/// compared with: the world, or the camera.
struct SolidPose {
  Vec3 position_m{};                             ///< of the solid's origin
  Rotation rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< its columns are the solid's axes

  Vec3 directionOut(const Vec3& d) const noexcept { return rotated(rotation, d); }
  Vec3 directionIn(const Vec3& d) const noexcept { return rotatedBack(rotation, d); }
  Vec3 placeOut(const Vec3& place_m_in_solid) const noexcept {
    return directionOut(place_m_in_solid) + position_m;
  }
  Vec3 placeIn(const Vec3& place_m) const noexcept { return directionIn(place_m - position_m); }
};

inline bool isFinite(const SolidPose& pose) noexcept {
  return isFinite(pose.position_m) &&
         std::ranges::all_of(pose.rotation, [](double r) { return std::isfinite(r); });
}

/// True if the rotation is one, to within 1e-6: orthonormal and right-handed.
inline bool isRigid(const SolidPose& pose) noexcept {
  const Vec3 x = pose.directionOut({1, 0, 0});
  const Vec3 y = pose.directionOut({0, 1, 0});
  const Vec3 off = cross(x, y) - pose.directionOut({0, 0, 1});
  constexpr double kTolerance = 1e-6;
  return isFinite(pose) && std::abs(norm(x) - 1) < kTolerance && std::abs(norm(y) - 1) < kTolerance &&
         std::abs(dot(x, y)) < kTolerance && norm(off) < kTolerance;
}

/// Rotation of a vector about the direction of `rotation_rad` by its length, right-handed.
inline Vec3 turned(const Vec3& v, const Vec3& rotation_rad) noexcept {
  const double angle = norm(rotation_rad);
  if (!(angle > 0)) return v;
  const Vec3 axis = (1 / angle) * rotation_rad;
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

/// The pose after the solid was turned about its place `centre_m` and then moved, both in the solid's own
/// frame. Its axes are made orthonormal again, so that any number of small motions leaves a rotation.
inline SolidPose movedInSolid(const SolidPose& pose, const Vec3& centre_m, const Vec3& rotation_rad,
                              const Vec3& shift_m) noexcept {
  Vec3 x = pose.directionOut(turned({1, 0, 0}, rotation_rad));
  Vec3 y = pose.directionOut(turned({0, 1, 0}, rotation_rad));
  x = (1 / norm(x)) * x;
  y = y - dot(x, y) * x;
  y = (1 / norm(y)) * y;
  const Vec3 z = cross(x, y);
  SolidPose moved;
  moved.rotation = {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
  moved.position_m = pose.placeOut(centre_m + shift_m) - moved.directionOut(centre_m);
  return moved;
}

/// Angle by which two poses differ, 0..pi.
inline double angleBetween_rad(const SolidPose& a, const SolidPose& b) noexcept {
  double trace = 0;
  for (std::size_t i = 0; i < 9; ++i) trace += a.rotation[i] * b.rotation[i];
  // The sine, which is exact near 0, by the antisymmetric part of A^T B.
  const Vec3 x = a.directionIn(b.directionOut({1, 0, 0}));
  const Vec3 y = a.directionIn(b.directionOut({0, 1, 0}));
  const Vec3 z = a.directionIn(b.directionOut({0, 0, 1}));
  const double sine = 0.5 * norm(Vec3{y.z - z.y, z.x - x.z, x.y - y.x});
  return std::atan2(sine, 0.5 * (trace - 1));
}

}  // namespace hapticd::rt
