// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "rt/forbidden_regions.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Computes the forces of all virtual fixtures.
///
/// Forbidden regions are constraints with one proxy for all of them: the allowed place nearest to the HIP,
/// which follows the HIP without passing through a region. Each region is replaced by the half-space that
/// touches it next to the proxy; the proxy moves to the point of all half-spaces that is nearest to the HIP
/// (half_spaces.h), and this is repeated from there. All shapes are convex, so the half-space of a region to
/// keep out of holds nothing of the region, and a step of any length is safe however thin the region is.
/// Regions to keep in are the intersection of such half-spaces. Along the live surface, for stand-offs, steps
/// are shorter than the distance from it. With the law `surface` the live surface constrains this proxy too.
///
/// The force is the gradient of an energy: a spring to that proxy, of the softest stiffness and the least
/// largest force of all regions, and for each region that is stiffer or stronger another one, of the
/// difference, to a proxy that obeys this region only. So a single region has its own spring exactly, regions
/// that meet hold in their corner, and no closed loop of the HIP gains energy. The largest force never moves
/// a proxy.
///
/// Thread: one.  RT: step() is safe.
class FixtureForces {
 public:
  using Memory = FixturesMemory;
  using Input = FixtureInput;

  struct Output {
    Vec3 spring_force_n;           ///< of the forbidden regions, without damping
    Vec3 force_n;                  ///< of the forbidden regions
    Vec3 guidance_force_n;         ///< of the guidance fixtures
    Vec3 proxy_m_in_world;         ///< the HIP while no region holds it
    std::uint32_t in_contact = 0;  ///< bit n: fixture n exerts a force
    bool holds = false;            ///< a forbidden region holds the HIP
    std::int32_t nearest = -1;     ///< forbidden region nearest to the HIP
    double distance_m = std::numeric_limits<double>::infinity();  ///< from the HIP to its boundary
    double stored_j = 0;                                          ///< in the springs of the forbidden regions
    Vec3 standoff_force_n;                                        ///< part of spring_force_n ...
    double standoff_j = 0;         ///< ... and of stored_j that comes from stand-offs
    double standoff_power_w = 0;   ///< exerted on the HIP by stand-offs that move with their surface
    double stiffness_n_per_m = 0;  ///< of the regions that hold the HIP, added up
    double damping_n_s_per_m = 0;  ///< the same for their damping
    /// Largest stiffness that can act along one normal near the HIP, in addition to the law's.
    double joint_stiffness_n_per_m = 0;
    bool redefined = false;  ///< the set is another one than in the last tick
  };

  Output step(const Input& input) HAPTICD_RT;

  /// Forgets the proxy and all places; the next tick begins as if all fixtures were new.
  void release() HAPTICD_RT { memory_ = {}; }

  const Memory& memory() const noexcept { return memory_; }
  void restore(const Memory& memory) noexcept { memory_ = memory; }

 private:
  class Tick;

  Memory memory_;
};

}  // namespace hapticd::rt
