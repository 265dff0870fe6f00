// SPDX-License-Identifier: Apache-2.0
#include "rt/shape.h"

namespace hapticd::rt {
namespace {

/// Shorter vectors have no usable direction.
constexpr double kNoDirection_m = 1e-12;

/// Any unit vector across `axis`.
Vec3 across(const Vec3& axis) noexcept {
  const Vec3 other = std::abs(axis.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 side = cross(axis, other);
  return (1 / norm(side)) * side;
}

SignedDistance fromPoint(const Vec3& offset_m, double radius_m, const Vec3& otherwise) noexcept {
  const double length = norm(offset_m);
  return {length - radius_m, length > kNoDirection_m ? (1 / length) * offset_m : otherwise};
}

SignedDistance fromBox(const Shape& box, const Vec3& offset_m) noexcept {
  const auto& r = box.rotation;
  const double local[3] = {r[0] * offset_m.x + r[3] * offset_m.y + r[6] * offset_m.z,
                           r[1] * offset_m.x + r[4] * offset_m.y + r[7] * offset_m.z,
                           r[2] * offset_m.x + r[5] * offset_m.y + r[8] * offset_m.z};
  const double half[3] = {box.half_size_m.x, box.half_size_m.y, box.half_size_m.z};
  double beyond[3];
  double normal[3] = {0, 0, 0};
  double outside_squared = 0;
  int nearest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    beyond[axis] = std::abs(local[axis]) - half[axis];
    if (beyond[axis] > beyond[nearest]) nearest = axis;
    const double out = std::max(beyond[axis], 0.0);
    outside_squared += out * out;
    normal[axis] = std::copysign(out, local[axis]);
  }
  double distance = beyond[nearest];
  if (distance > 0) {
    distance = std::sqrt(outside_squared);
    for (double& component : normal) component /= distance;
  } else {
    normal[nearest] = std::copysign(1.0, local[nearest]);
  }
  return {distance,
          {r[0] * normal[0] + r[1] * normal[1] + r[2] * normal[2],
           r[3] * normal[0] + r[4] * normal[1] + r[5] * normal[2],
           r[6] * normal[0] + r[7] * normal[1] + r[8] * normal[2]}};
}

/// The distance in the half plane through the axis, where the cone is a sector: its side is a ray from the
/// tip.
SignedDistance fromCone(const Shape& cone, const Vec3& offset_m) noexcept {
  const double along = dot(offset_m, cone.axis_in_world);
  const Vec3 aside = offset_m - along * cone.axis_in_world;
  const double off_axis = norm(aside);
  const Vec3 radial = off_axis > kNoDirection_m ? (1 / off_axis) * aside : across(cone.axis_in_world);
  const double sine = cone.half_angle_sine;
  const double cosine = cone.half_angle_cosine;
  if (along * cosine + off_axis * sine < 0) return fromPoint(offset_m, 0, -cone.axis_in_world);
  return {off_axis * cosine - along * sine, cosine * radial - sine * cone.axis_in_world};
}

}  // namespace

SignedDistance distanceFrom(const Shape& shape, const Vec3& p_m_in_world) noexcept {
  const Vec3 offset = p_m_in_world - shape.position_m_in_world;
  switch (shape.kind) {
    case ShapeKind::plane:
      return {dot(offset, shape.axis_in_world), shape.axis_in_world};
    case ShapeKind::sphere:
      return fromPoint(offset, shape.radius_m, {0, 0, 1});
    case ShapeKind::capsule: {
      const double along = std::clamp(dot(offset, shape.axis_in_world), 0.0, shape.length_m);
      return fromPoint(offset - along * shape.axis_in_world, shape.radius_m, across(shape.axis_in_world));
    }
    case ShapeKind::box:
      return fromBox(shape, offset);
    case ShapeKind::cone:
      break;
  }
  return fromCone(shape, offset);
}

}  // namespace hapticd::rt
