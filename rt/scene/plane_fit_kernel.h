// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/scene/scene.h"
#include "rt/scene/search_kernel.h"

namespace hapticd::rt {

/// Weighted sums over the points v around a place, with x and y along the surface and h along its normal. The
/// weight is (1 - s^2 / radius^2)^2 (1 - h^2 / band^2)^2 with s = |v|, and zero beyond radius or band.
struct PlaneSums {
  double w = 0, x = 0, y = 0, h = 0, xx = 0, xy = 0, yy = 0, xh = 0, yh = 0, hh = 0;
};

/// Input of sumForPlane(). The axes are orthogonal unit vectors in world coordinates.
struct PlaneQuery {
  LocalBall ball;      ///< the place and the larger of the radii
  Vec3 along_x;        ///< first axis along the surface
  Vec3 along_y;        ///< second axis along the surface
  Vec3 normal;         ///< normal of the surface
  Vec3 line_of_sight;  ///< unit vector from the camera to the place
  double small_radius_m;
  double small_band_m;
  double large_radius_m;
  double large_band_m;
};

/// Result of sumForPlane().
struct PlanePoints {
  PlaneSums small;
  PlaneSums large;
  std::uint32_t points = 0;  ///< number of points in the ball
  double nearest_m = 0;      ///< distance of the nearest one; the ball's radius if there are none
  /// Smallest distance from the line of sight of those in the larger band; the radius if none.
  double nearest_beside_m = 0;
};

/// Sums over the points in the ball in one pass, in single precision relative to the grid's origin.
/// RT: safe after the first call.  Cost: bounded by the rows of voxels and the points in the ball's voxels.
PlanePoints sumForPlane(const Scene& scene, const PlaneQuery& query) HAPTICD_RT;

/// Returns how far the points in the ball and within `band_m` of the plane through its centre extend in
/// `direction`: metres from the centre, negative if all lie behind it, -radius if there are none.
/// RT: safe after the first call.
double reachOfPoints_m(const Scene& scene, const LocalBall& ball, const Vec3& normal, double band_m,
                       const Vec3& direction) HAPTICD_RT;

}  // namespace hapticd::rt
