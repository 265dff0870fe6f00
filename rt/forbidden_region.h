// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "rt/fixture.h"
#include "rt/joint_stiffness.h"
#include "rt/saturating_spring.h"
#include "rt/shape.h"
#include "rt/vec3.h"

/// One forbidden region: the proxy that it holds, and the spring from the HIP to that proxy.
///
/// The proxy is the allowed place nearest to the HIP that can be reached without passing through the region.
/// It obeys this region only, so what other regions do changes nothing here. The spring's energy is a
/// function of the HIP's depth, the distance from its proxy, and its force is the negative gradient of that
/// energy.
namespace hapticd::rt {

/// Fastest growth of a region into the place where the HIP is, however it came to be there: the region
/// appeared, was moved, or became larger.
inline constexpr double kMaxGrowth_m_per_s = 0.005;

/// What a forbidden region keeps from one tick to the next.
struct RegionMemory {
  bool held = false;             ///< the region holds its proxy off the HIP
  bool keeps_inside = false;     ///< the HIP is kept inside the shape
  Shape shape;                   ///< as of the last tick
  Vec3 proxy_m_in_world;         ///< while held
  Vec3 normal_in_world;          ///< unit vector from the HIP to the proxy; while free, the last one
  double depth_m = 0;            ///< of the HIP behind the boundary; 0: free
  double room_m = 0;             ///< while free: the region is at least this far from the HIP
  double give_m = 0;             ///< the spring begins at this depth, see kMaxGrowth_m_per_s ...
  double give_m_per_s = 0;       ///< ... which falls at this rate
  double stiffness_n_per_m = 0;  ///< in effect: does not rise while the spring acts
  double max_force_n = 0;        ///< the same
  StiffnessShare share;

  double springDepth_m() const noexcept { return depth_m > give_m ? depth_m - give_m : 0; }
  SaturatingSpring spring() const noexcept { return {share.value() * stiffness_n_per_m, max_force_n}; }
  double energy_j() const noexcept { return spring().energy_j(springDepth_m()); }
};
static_assert(std::is_trivially_copyable_v<RegionMemory>);

/// The HIP and one region in a tick.
struct RegionPlace {
  double depth_m = 0;       ///< of the HIP behind the boundary; 0: free
  double room_m = 0;        ///< while free: the region is at least this far from the HIP
  Vec3 normal_in_world{};   ///< unit vector from the HIP to the proxy; while free, out of the region
  Vec3 proxy_m_in_world{};  ///< the HIP while free
};

/// Moves the proxy of a shape (not a stand-off). `from_m`: where the proxy was, an allowed place; the HIP of
/// the last tick where it was free. `clearance_m`: the region is larger by this at each boundary.  RT: safe.
RegionPlace followShape(const Shape& shape, bool keeps_inside, double clearance_m, const Vec3& hip_m,
                        const Vec3& from_m) noexcept;

/// Returns the signed distance of a place from the boundary of a region, positive where it is allowed.  RT:
/// safe.
double distanceFromRegion(const Shape& shape, bool keeps_inside, double clearance_m,
                          const Vec3& place_m) noexcept;

/// Returns where a place that moves with a shape is after the shape has moved.  RT: safe.
Vec3 carriedAlong(const Vec3& place_m, const Shape& from, const Shape& to) noexcept;

/// Lets the region of `fixture` grow, and its spring follow the configured one, by `period_s`. In contact
/// neither stiffness nor largest force rises, and what the stiffness limit permits rises no faster than the
/// region may grow. Returns the work that these changes did on the spring.  RT: safe.
double advance(const Fixture& fixture, double period_s, RegionMemory& memory) noexcept;

/// Lets the spring begin at the depth that the HIP has beyond `spring_depth_m`, and the region grow from
/// there.  RT: safe.
void beginAtDepth(const Fixture& fixture, double spring_depth_m, double period_s,
                  RegionMemory& memory) noexcept;

}  // namespace hapticd::rt
