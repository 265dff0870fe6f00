// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/realtime_safe.h"
#include "rt/scene.h"

namespace hapticd::rt {

/// Below this distance a point counts as coinciding with the HIP.
inline constexpr double kCoincident_m = 1e-9;

/// Points found by a search, as two arrays with room for all points of a scene and one vector more.
struct Candidates {
  float* distance_squared_m2;  ///< single precision
  std::uint32_t* pixel;        ///< PackedPixel
  std::uint32_t count;
};

/// A ball in the grid's own coordinates: metres from Scene::origin_m_in_world.
struct LocalBall {
  float x_m, y_m, z_m;
  float radius_m;
};

/// Finds the points whose single-precision distance from the ball's centre is at most its radius. Touches
/// only voxels that meet the ball. `candidates.count` is set. RT: safe after the first call. Cost: bounded by
/// the rows of voxels and the points in the ball's voxels.
void findInBall(const Scene& scene, const LocalBall& ball, Candidates& candidates) HAPTICD_RT;

/// How many candidates have a squared distance of at most `limit_m2`.  RT: safe after the first call.
std::uint32_t countWithin(const Candidates& candidates, float limit_m2) HAPTICD_RT;

/// Keeps the pixels of the candidates with a squared distance of at most `near_m2` in `candidates`, whose
/// distances are lost, and writes the pixels of those above it but at most `far_m2` to `between`, which has
/// the same room. Returns how many those are.  RT: safe after the first call.
std::uint32_t takeBetween(Candidates& candidates, float near_m2, float far_m2,
                          std::uint32_t* between) HAPTICD_RT;

/// Leaves at most `most` of the candidates, evenly spread over them; their distances are lost. Means over
/// points stay what they were, within the spread of a sample of that size. No real scene has that many points
/// near the HIP; it bounds the time that a made-up one can take.  RT: safe.
inline void thinOut(Candidates& candidates, std::uint32_t most) noexcept {
  if (candidates.count <= most) return;
  const std::uint32_t step = (candidates.count + most - 1) / most;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += step) candidates.pixel[kept++] = candidates.pixel[i];
  candidates.count = kept;
}

/// Working memory of sumOfUnitSprings().
struct WorkVector {
  double x, y, z, unused;
};

/// Sum of (D_thresh / s - 1) * V of eq. (9)-(10) over the points of `count` pixels, without k_s; s = |V|.
/// A point with s below 1e-9 m adds nothing. Double precision throughout. `work` has room for
/// `count` + kVectorPadding vectors.
/// RT: safe after the first call.
Vec3 sumOfUnitSprings(const DepthModel& model, const std::uint32_t* pixels, std::uint32_t count,
                      const Vec3& hip_m_in_world, double radius_m, WorkVector* work) HAPTICD_RT;

/// A sum over points, each with a weight.
struct WeightedSum {
  Vec3 sum;
  double weight = 0;
  double nearest_m = 0;  ///< distance of the nearest of the points; without any, the radius
};

/// Over the points of `count` pixels, V from each to the HIP as in eq. (9), s = |V|, points with s above
/// `radius_m` left out, w = 1 - s / radius: sum of w (radius - s) V / max(s, fade_m), and of w.
WeightedSum sumOfSmoothSprings(const DepthModel& model, const std::uint32_t* pixels, std::uint32_t count,
                               const Vec3& hip_m_in_world, double radius_m, double fade_m,
                               WorkVector* work) HAPTICD_RT;

}  // namespace hapticd::rt
