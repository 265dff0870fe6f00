// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Below this distance a point counts as coinciding with the HIP.
inline constexpr double kCoincident_m = 1e-9;

/// Points found by a search, as two arrays with room for all points of a scene and one more vector.
struct Candidates {
  float* distance_squared_m2;  ///< single precision
  std::uint32_t* pixel;        ///< PackedPixel
  std::uint32_t count;
};

/// A ball in grid coordinates: metres relative to Scene::origin_m_in_world.
struct LocalBall {
  float x_m, y_m, z_m;
  float radius_m;
};

/// Finds the points whose single-precision distance from the ball's centre is at most its radius, visiting
/// only voxels that meet the ball. Sets `candidates.count`.
/// RT: safe after the first call.  Cost: bounded by the rows of voxels and the points in the ball's voxels.
void findInBall(const Scene& scene, const LocalBall& ball, Candidates& candidates) HAPTICD_RT;

/// Returns the number of candidates with a squared distance of at most `limit_m2`.  RT: safe after the first
/// call.
std::uint32_t countWithin(const Candidates& candidates, float limit_m2) HAPTICD_RT;

/// Keeps in `candidates` the pixels with a squared distance of at most `near_m2` (their distances are lost)
/// and writes the pixels above it and up to `far_m2` to `between`, which has the same room. Returns the
/// number of the latter.
/// RT: safe after the first call.
std::uint32_t takeBetween(Candidates& candidates, float near_m2, float far_m2,
                          std::uint32_t* between) HAPTICD_RT;

/// Reduces the candidates to at most `max_count`, spread evenly; their distances are lost. Means over points
/// stay the same within the sampling error. No real scene has that many points near the HIP; this bounds the
/// time for synthetic ones.  RT: safe.
inline void thinOut(Candidates& candidates, std::uint32_t max_count) noexcept {
  if (candidates.count <= max_count) return;
  const std::uint32_t step = (candidates.count + max_count - 1) / max_count;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += step) candidates.pixel[kept++] = candidates.pixel[i];
  candidates.count = kept;
}

/// Working memory of sumOfUnitSprings().
struct WorkVector {
  double x, y, z, unused;
};

/// Returns the sum of (D_thresh / s - 1) * V of eq. (9)-(10), without k_s, over `count` pixels of a scene,
/// with s = |V|, in double precision. A point with s below 1e-9 m adds nothing. `work` has room for `count` +
/// kVectorPadding vectors.
/// RT: safe after the first call.
Vec3 sumOfUnitSprings(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                      const Vec3& hip_m_in_world, double radius_m, WorkVector* work) HAPTICD_RT;

/// A weighted sum over points.
struct WeightedSum {
  Vec3 sum;
  double weight = 0;
  double nearest_m = 0;  ///< distance of the nearest point; the radius if there is none
};

/// Returns the sums of w (radius - s) V / max(s, fade_m) and of w over `count` pixels, with V from each point
/// to the HIP as in eq. (9), s = |V| and w = 1 - s / radius; points with s above `radius_m` are left out.
/// RT: safe after the first call.
WeightedSum sumOfSmoothSprings(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                               const Vec3& hip_m_in_world, double radius_m, double fade_m,
                               WorkVector* work) HAPTICD_RT;

}  // namespace hapticd::rt
