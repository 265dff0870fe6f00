// SPDX-License-Identifier: Apache-2.0
#include "rt/force_laws.h"

#include "rt/proxy.h"
#include "rt/smooth_springs.h"
#include "rt/surface.h"

namespace hapticd::rt {
namespace {

/// Returns true if the scene holds the kind of data that the law reads.
bool serves(const Scene& scene, ForceLaw law) noexcept {
  switch (law) {
    case ForceLaw::nearest_springs:
    case ForceLaw::smooth_springs:
      return scene.has_points;
    case ForceLaw::proxy:
      return scene.has_points && scene.has_image;
    case ForceLaw::surface:
      return scene.has_surface;
  }
  return false;
}

ForceSample nothing(const LawInput& input, bool outside_model) noexcept {
  return {.force_n_in_world = {},
          .proxy_m_in_world = input.hip_m_in_world,
          .normal_in_world = {},
          .outside_model = outside_model};
}

ForceSample withoutProxy(const LawInput& input, ForceSample sample) noexcept {
  sample.proxy_m_in_world = input.hip_m_in_world;
  return sample;
}

}  // namespace

ForceSample ForceLaws::force(const LawInput& input) HAPTICD_RT {
  if (input.scene.frame == 0 || !isFinite(input.hip_m_in_world)) return nothing(input, true);
  if (serves(input.scene, input.parameters.law)) law_ = input.parameters.law;
  if (!serves(input.scene, law_)) return nothing(input, true);
  if (!hasProxy(law_)) {
    release();
    if (!input.scene.covers(input.hip_m_in_world, input.parameters.springs.radius_m))
      return nothing(input, true);
  }
  switch (law_) {
    case ForceLaw::nearest_springs:
      return withoutProxy(
          input, nearestSprings(input.scene, input.hip_m_in_world, input.parameters.springs, search_));
    case ForceLaw::smooth_springs:
      return smoothSprings(input, search_);
    case ForceLaw::proxy:
      return proxyForce(input, proxy_);
    case ForceLaw::surface:
      return surfaceForce(input, proxy_);
  }
  return nothing(input, true);
}

}  // namespace hapticd::rt
