// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_model.h"
#include "rt/tissue/tissue.h"

namespace hapticd::rt {

/// Presence of a region at a place, and its gradient in space. Both are continuous.
struct Presence {
  double value = 0;  ///< 0..1
  Vec3 gradient_per_m_in_world;
  double bend_per_m2 = 0;  ///< bound of the second derivative where it is between 0 and 1
};

/// The regions at one place and their shares, which add up to 1 with that of the rest.
struct TissueShares {
  struct Entry {
    std::size_t region = 0;  ///< place in TissueMap::regions
    double share = 0;        ///< > 0
    Vec3 gradient_per_m_in_world{};
    double bend_per_m2 = 0;  ///< bound of the share's second derivative
  };
  std::array<Entry, kMaxTissueRegions> entries;  ///< the first `count` are set
  std::size_t count = 0;
  Entry rest{.region = kMaxTissueRegions, .share = 1};  ///< what no region covers
};

/// Returns how much `shape` (sphere, box or capsule) is present at `p_m_in_world`: a smoothstep of the signed
/// distance, `transition_m` wide and half of it inside, and narrower where the shape is thinner than that.
/// For a box it is the product of those along its axes, which unlike the signed distance has no kink at an
/// edge.  RT: safe.
Presence presenceOf(const Shape& shape, double transition_m, const Vec3& p_m_in_world) HAPTICD_RT;

/// Returns the shares of the regions of `map` at `p_m_in_world`. `model`: of the camera that the label image
/// belongs to; null: labels are nowhere. Cost: bounded by the number of regions, and 89 places of the label
/// image for each width of transition.  RT: safe.
TissueShares sharesAt(const TissueMap& map, const DepthModel* model, const Vec3& p_m_in_world) HAPTICD_RT;

}  // namespace hapticd::rt
