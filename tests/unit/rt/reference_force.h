// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/parameters.h"
#include "rt/vec3.h"
#include "tests/unit/rt/reference_camera.h"

namespace hapticd::test {

struct ReferenceForce {
  rt::Vec3 force_n_in_world;
  std::uint32_t points_used = 0;
  /// The choice of points depends on distances that differ by less than rounding (1e-12 m): another choice is
  /// equally correct.
  bool undecided = false;
};

/// Evaluates eq. (6)-(11) by examining every point of the cloud, in double precision.
ReferenceForce bruteForce(const PointCloud& cloud, const rt::Vec3& hip_m_in_world,
                          const rt::SpringParameters& parameters);

/// Returns the distance in metres from the HIP to the n-th nearest point; n = 1 for the nearest.
double distanceOfRank(const PointCloud& cloud, const rt::Vec3& hip_m_in_world, std::size_t n);

/// Returns how far the law's force may deviate from bruteForce() by rounding alone, in newtons. Positions of
/// a few metres are rounded to about 1e-15 m, which changes the direction of a spring of length s by 1e-15 /
/// s; s is at least 1e-6 m here (1e-8 N for k D = 20 N; all other rounding is much smaller).
inline double roundingTolerance_n(const rt::SpringParameters& parameters) {
  return 1e-9 * parameters.stiffness_n_per_m * parameters.radius_m;
}

}  // namespace hapticd::test
