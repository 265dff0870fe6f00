// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/focus_body.h"

#include <cmath>

namespace hapticd::rt {
namespace {

/// Returns the curvature along the normal that makes the quadric exact for planes, spheres (k, k) and
/// cylinders (k, 0): k in each case. On saddles both principal curvatures and their sum are small or none is
/// exact.
double curvatureAlongNormal(const TangentCurvature& k) noexcept {
  const double trace = k.along_1 + k.along_2;
  const double determinant = k.along_1 * k.along_2 - k.twist * k.twist;
  return determinant > 0 ? trace - 2 * determinant / trace : trace;
}

}  // namespace

void FocusBody::updateMatrix() noexcept {
  const Vec3& n = normal;
  const Vec3& e = tangent;
  const Vec3 f = otherTangent();
  const double nn = curvatureAlongNormal(curvature);
  const auto element = [&](double Vec3::*i, double Vec3::*j) {
    return curvature.along_1 * e.*i * e.*j + curvature.twist * (e.*i * f.*j + f.*i * e.*j) +
           curvature.along_2 * f.*i * f.*j + nn * n.*i * n.*j;
  };
  a = {.xx = element(&Vec3::x, &Vec3::x),
       .xy = element(&Vec3::x, &Vec3::y),
       .xz = element(&Vec3::x, &Vec3::z),
       .yy = element(&Vec3::y, &Vec3::y),
       .yz = element(&Vec3::y, &Vec3::z),
       .zz = element(&Vec3::z, &Vec3::z)};
}

FocusBody::Crossing FocusBody::crossing(double dx, double dy) const noexcept {
  // With the ray r = r0 + d and y = d + t r the quadric becomes a t^2 + b t + c = 0.
  const Vec3 r0 = ray();
  const Vec3 a_r0 = a * r0;
  const double tilt = normal.x * dx + normal.y * dy;
  const double linear = a_r0.x * dx + a_r0.y * dy;
  const double square = dx * (a.xx * dx + 2 * a.xy * dy) + a.yy * dy * dy;
  const double two_a = dot(r0, a_r0) + 2 * linear + square;
  const double b = dot(normal, r0) + tilt + linear + square;
  const double c = tilt + 0.5 * square;
  const double discriminant = b * b - 2 * two_a * c;
  if (!(discriminant > kLeastCosine * kLeastCosine)) return {};
  Crossing result;
  result.cosine = std::sqrt(discriminant);
  const double t = 2 * c / (result.cosine - b);
  result.stretch = 1 + t;
  if (!(result.stretch > kLeastStretch)) return {};
  result.exists = true;
  result.y = Vec3{dx, dy, 0} + t * Vec3{ray_x + dx, ray_y + dy, 1};
  result.normal = normal + a * result.y;
  return result;
}

FocusBody FocusBody::movedTo(double dx, double dy) const noexcept {
  FocusBody moved = *this;
  const Crossing there = crossing(dx, dy);
  moved.exists = exists && there.exists;
  if (!moved.exists) return moved;
  const double length = norm(there.normal);
  moved.inverse_depth_per_m = inverse_depth_per_m / there.stretch;
  moved.ray_x += dx;
  moved.ray_y += dy;
  moved.normal = (1 / length) * there.normal;
  const Vec3 in_plane = tangent - dot(tangent, moved.normal) * moved.normal;
  moved.tangent = (1 / norm(in_plane)) * in_plane;
  const Vec3 other = moved.otherTangent();
  // The curvature is that of the quadric divided by the length of its gradient, times the new depth.
  const double scale = there.stretch / length;
  moved.curvature = {.along_1 = scale * dot(moved.tangent, a * moved.tangent),
                     .twist = scale * dot(moved.tangent, a * other),
                     .along_2 = scale * dot(other, a * other)};
  moved.updateMatrix();
  return moved;
}

}  // namespace hapticd::rt
