// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/smooth_springs.h"

#include <algorithm>

#include "rt/scene/search_kernel.h"

namespace hapticd::rt {

ForceSample smoothSprings(const LawInput& input, SearchMemory& memory) HAPTICD_RT {
  constexpr double kFade_m = 0.001;
  const SpringParameters& springs = input.parameters.force;
  const Scene& scene = input.scene;
  ForceSample result;
  result.proxy_m_in_world = input.hip_m_in_world;
  const double search_m = springs.radius_m + scene.depth_model->singlePrecisionError_m();
  const Vec3 local = input.hip_m_in_world - scene.origin_m_in_world;
  Candidates found = memory.candidates();
  findInBall(scene,
             {static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z),
              static_cast<float>(search_m)},
             found);
  // A wall 0.4 m away has 11,000 points in the ball of radius D_thresh.
  constexpr std::uint32_t kMaxPoints = 16384;
  thinOut(found, kMaxPoints);
  const WeightedSum sum = sumOfSmoothSprings(scene, found.pixel, found.count, input.hip_m_in_world,
                                             springs.radius_m, kFade_m, memory.work());
  if (sum.weight <= 0) return result;
  const double min_weight = springs.min_points / 3.0;
  result.force_n_in_world = (input.stiffness_n_per_m / std::max(sum.weight, min_weight)) * sum.sum;
  result.points_used = found.count;
  return result;
}

}  // namespace hapticd::rt
