// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/scene/disparity_motion.h"

namespace hapticd::rt {

/// A symmetric matrix.
struct Symmetric3 {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  Vec3 operator*(const Vec3& v) const noexcept {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
};

/// Second-order coefficients of a surface in the basis (e1, e2) of its tangent plane: curvature times depth,
/// positive where the surface is convex.
struct TangentCurvature {
  double along_1 = 0;
  double twist = 0;
  double along_2 = 0;
};

/// The surface of the one body that the camera sees at the focus, in closed form: a quadric that is exact for
/// planes, spheres and cylinders and osculates every other smooth surface.
///
/// All vectors are in image axes (x right, y down, z forward). With the ray r0 = (x, y, 1) of the focus, the
/// inverse depth w0 of the surface there, and y = w0 (X - r0 / w0) for a place X, the surface is
/// n y + y A y / 2 = 0. The matrix A has the tangential curvatures and, along n, the curvature that makes it
/// exact for spheres and cylinders.
struct FocusBody {
  /// A ray that grazes the body at less than about 8 degrees counts as missing it: there the disparity
  /// changes faster than from one pixel to the next.
  static constexpr double kLeastCosine = 0.14;
  /// What would be nearer than this share of the depth of the focus does not belong to the body.
  static constexpr double kLeastStretch = 0.1;

  bool exists = false;
  double column_px = 0;  ///< of the focus
  double row_px = 0;
  double radius_px = 0;            ///< up to this distance from the focus the body is known
  double inverse_depth_per_m = 0;  ///< w0
  double ray_x = 0;                ///< of r0
  double ray_y = 0;
  Vec3 normal{0, 0, -1};  ///< n, a unit vector towards the free side
  Vec3 tangent{1, 0, 0};  ///< e1; e2 = n x e1
  TangentCurvature curvature;
  Symmetric3 a;                ///< A
  DisparityMotion per_second;  ///< change of the disparity due to motion
  double tolerance_raw = 0;    ///< a pixel within this of the body belongs to it

  Vec3 ray() const noexcept { return {ray_x, ray_y, 1}; }
  Vec3 otherTangent() const noexcept { return cross(normal, tangent); }
  /// Computes `a` from `curvature`.  RT: safe.
  void updateMatrix() noexcept;

  /// The body on another ray.
  struct Crossing {
    bool exists = false;
    double stretch = 1;  ///< depth relative to that at the focus
    double cosine = 0;   ///< of the angle of incidence times the length of the ray
    Vec3 y;              ///< where the ray meets the body, see above
    Vec3 normal;         ///< not of unit length; normal * ray == -cosine
  };
  /// Returns where the ray that differs from r0 by (dx, dy, 0) meets the body.  RT: safe.
  Crossing crossing(double dx, double dy) const noexcept;

  /// Returns the same body with another focus on it, whose ray differs from r0 by (dx, dy, 0); `exists` is
  /// false if that ray misses it.  RT: safe.
  FocusBody movedTo(double dx, double dy) const noexcept;
};
static_assert(std::is_trivially_copyable_v<FocusBody>);

}  // namespace hapticd::rt
