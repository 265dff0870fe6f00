// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/realtime_safe.h"
#include "rt/scene.h"
#include "rt/search_kernel.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Sums over the points v around a place, x and y along the surface, h along its normal, each weighted by
/// (1 - s^2 / radius^2)^2 (1 - h^2 / band^2)^2, s = |v|; points beyond radius or band have no weight.
struct PlaneSums {
  double w = 0, x = 0, y = 0, h = 0, xx = 0, xy = 0, yy = 0, xh = 0, yh = 0, hh = 0;
};

/// Where to sum and how. Axes are orthogonal unit vectors.
struct PlaneQuery {
  LocalBall ball;  ///< the place, and the larger of the radii
  Vec3 along_x;    ///< of the surface
  Vec3 along_y;
  Vec3 normal;
  Vec3 line_of_sight;  ///< from the camera to the place, a unit vector
  double small_radius_m;
  double small_band_m;
  double large_radius_m;
  double large_band_m;
};

/// What lies around the place.
struct PlanePoints {
  PlaneSums small;
  PlaneSums large;
  std::uint32_t points = 0;     ///< in the ball
  double nearest_m = 0;         ///< of them; the ball's radius when there are none
  double nearest_beside_m = 0;  ///< of those in the larger band, from the line of sight; likewise
};

/// One pass over the points in the ball, in single precision relative to the grid's origin.  RT: safe after
/// the first call. Cost: bounded by the rows of voxels and the points in the ball's voxels.
PlanePoints sumForPlane(const Scene& scene, const PlaneQuery& query) HAPTICD_RT;

/// The farthest that a point in the ball and within `band_m` of the plane through its centre reaches in
/// `direction`, metres from the centre; negative when all lie behind it; -radius when there are none.  RT:
/// safe after the first call.
double reachOfPoints_m(const Scene& scene, const LocalBall& ball, const Vec3& normal, double band_m,
                       const Vec3& direction) HAPTICD_RT;

}  // namespace hapticd::rt
