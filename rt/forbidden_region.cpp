// SPDX-License-Identifier: Apache-2.0
#include "rt/forbidden_region.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::rt {
namespace {

/// The proxy has arrived when it moves by less.
constexpr double kArrived_m = 1e-9;
/// Bound of the linear pieces by which a proxy moves in a tick; two are enough where the boundary is flat.
constexpr int kMaxPieces = 8;

/// Rotates a vector by the smallest rotation that takes one unit vector to another.
Vec3 rotatedLike(const Vec3& v, const Vec3& from, const Vec3& to) noexcept {
  const Vec3 axis = cross(from, to);
  const double cosine = dot(from, to);
  if (cosine < -0.999999) return v - 2 * dot(v, from) * from;
  return v + cross(axis, v) + (1 / (1 + cosine)) * cross(axis, cross(axis, v));
}

Vec3 times(const std::array<double, 9>& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}
Vec3 transposedTimes(const std::array<double, 9>& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
          r[2] * v.x + r[5] * v.y + r[8] * v.z};
}

/// Returns the shape of all places that are at least `m` below the boundary of `shape`; there must be one.
Shape inset(Shape shape, double m) noexcept {
  switch (shape.kind) {
    case ShapeKind::plane:
      shape.position_m_in_world += -m * shape.axis_in_world;
      break;
    case ShapeKind::sphere:
    case ShapeKind::capsule:
      shape.radius_m -= m;
      break;
    case ShapeKind::box:
      shape.half_size_m = shape.half_size_m - Vec3{m, m, m};
      break;
    case ShapeKind::cone:
      shape.position_m_in_world += (m / shape.half_angle_sine) * shape.axis_in_world;
      break;
  }
  return shape;
}

/// The shape is convex, so the nearest place in it is unique, and the distance outside of it exact.
RegionPlace followInside(const Shape& shape, double clearance_m, const Vec3& hip_m) noexcept {
  const SignedDistance outside = distanceFrom(clearance_m > 0 ? inset(shape, clearance_m) : shape, hip_m);
  RegionPlace place{.normal_in_world = -outside.normal_in_world};
  if (outside.distance_m > 0) {
    place.depth_m = outside.distance_m;
    place.proxy_m_in_world = hip_m + outside.distance_m * place.normal_in_world;
  } else {
    place.room_m = -outside.distance_m;
    place.proxy_m_in_world = hip_m;
  }
  return place;
}

/// Replaces the shape by the half-space that touches it next to the proxy. The shape is convex, so the
/// half-space's free side holds nothing of it, and a step of any length within that side is safe, however
/// thin the shape is.
RegionPlace followOutside(const Shape& shape, double clearance_m, const Vec3& hip_m,
                          const Vec3& from_m) noexcept {
  RegionPlace place{.proxy_m_in_world = from_m};
  for (int piece = 0; piece < kMaxPieces; ++piece) {
    const Vec3 before_m = place.proxy_m_in_world;
    const SignedDistance here = distanceFrom(shape, before_m);
    const Vec3& n = here.normal_in_world;
    const double room_m = dot(n, hip_m - before_m) + here.distance_m - clearance_m;
    place.normal_in_world = n;
    if (room_m >= 0) return {.room_m = room_m, .normal_in_world = n, .proxy_m_in_world = hip_m};
    place.depth_m = -room_m;
    place.proxy_m_in_world = hip_m - room_m * n;
    if (norm(place.proxy_m_in_world - before_m) < kArrived_m) break;
  }
  return place;
}

}  // namespace

RegionPlace followShape(const Shape& shape, bool keeps_inside, double clearance_m, const Vec3& hip_m,
                        const Vec3& from_m) noexcept {
  return keeps_inside ? followInside(shape, clearance_m, hip_m)
                      : followOutside(shape, clearance_m, hip_m, from_m);
}

double distanceFromRegion(const Shape& shape, bool keeps_inside, double clearance_m,
                          const Vec3& place_m) noexcept {
  if (!keeps_inside) return distanceFrom(shape, place_m).distance_m - clearance_m;
  return -distanceFrom(clearance_m > 0 ? inset(shape, clearance_m) : shape, place_m).distance_m;
}

Vec3 carriedAlong(const Vec3& place_m, const Shape& from, const Shape& to) noexcept {
  const Vec3 offset = place_m - from.position_m_in_world;
  Vec3 turned = offset;
  if (from.kind == ShapeKind::box) {
    turned = times(to.rotation, transposedTimes(from.rotation, offset));
  } else if (from.kind != ShapeKind::sphere) {
    turned = rotatedLike(offset, from.axis_in_world, to.axis_in_world);
  }
  return to.position_m_in_world + turned;
}

double advance(const Fixture& fixture, double period_s, RegionMemory& memory) noexcept {
  const double before_j = memory.energy_j();
  const double depth_m = memory.springDepth_m();
  if (depth_m > 0) {
    memory.stiffness_n_per_m = std::min(memory.stiffness_n_per_m, fixture.stiffness_n_per_m);
    memory.max_force_n = std::min(memory.max_force_n, fixture.max_force_n);
    memory.share.advance(
        period_s, std::min(StiffnessShare::kRise_per_s, kMaxGrowth_m_per_s * memory.share.value() / depth_m));
  } else {
    memory.stiffness_n_per_m = fixture.stiffness_n_per_m;
    memory.max_force_n = fixture.max_force_n;
    memory.share.arrive();
  }
  memory.give_m = std::max(0.0, memory.give_m - memory.give_m_per_s * period_s);
  return memory.energy_j() - before_j;
}

void beginAtDepth(const Fixture& fixture, double spring_depth_m, double period_s,
                  RegionMemory& memory) noexcept {
  memory.give_m = std::max(0.0, memory.depth_m - spring_depth_m);
  memory.give_m_per_s = std::min(kMaxGrowth_m_per_s, memory.give_m / std::max(fixture.fade_in_s, period_s));
}

}  // namespace hapticd::rt
