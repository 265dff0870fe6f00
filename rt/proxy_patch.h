// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/realtime_safe.h"
#include "rt/scene.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// How large the piece of surface is that the law `proxy` takes for a plane, at the distance of a place.
///
/// Neighbouring pixels of the sensor share their noise, over about 9 px: a patch must be larger for its tilt
/// to be known. So it is large where the points are flat up to noise, and small where they are not.
struct PatchSizes {
  double pitch_m;  ///< between neighbouring pixels' rays
  double noise_m;  ///< standard deviation of the sensor's noise along the optical axis
  double small_radius_m;
  double large_radius_m;

  /// `least_radius_m`: where pixels are dense; `most_radius_m`: of which points are modelled around the
  /// place.  RT: safe.
  static PatchSizes at(const DepthModel& model, double depth_m, double least_radius_m,
                       double most_radius_m) noexcept;
};

/// The piece of surface next to a place, as a plane.
struct Patch {
  std::uint32_t points = 0;  ///< around the place
  double nearest_m = 0;      ///< of them; the larger radius when there are none
  bool exists = false;       ///< there are enough of them for a plane
  Vec3 normal;               ///< unit vector towards the camera's side
  double height_m = 0;       ///< of the place above the plane, along the normal
  bool supported = false;    ///< the surface does not end before the foot of the place, within a pixel
};

/// The patch around `place_m_in_world`. `side_in_world`: about where the surface faces, a unit vector.
/// `band_m`: points farther from the plane through the place with that normal are of something else.  RT:
/// safe. Cost: two passes over the points within sizes.large_radius_m at most.
Patch patchAt(const Scene& scene, const Vec3& place_m_in_world, const Vec3& side_in_world,
              const PatchSizes& sizes, double band_m) HAPTICD_RT;

}  // namespace hapticd::rt
