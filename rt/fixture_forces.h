// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "rt/fixture.h"
#include "rt/fixture_state.h"
#include "rt/forbidden_region.h"
#include "rt/force_law.h"
#include "rt/guidance.h"
#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/scene.h"
#include "rt/standoff.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// What one fixture keeps from one tick to the next.
struct FixtureMemory {
  std::uint64_t definition = 0;  ///< Fixture::definition; 0: the fixture does not act
  std::uint32_t identity = 0;    ///< Fixture::identity
  /// Signed distance of the HIP from the boundary, or its distance from path or point, when it was last
  /// computed; not a number: not known.
  double distance_m = std::numeric_limits<double>::quiet_NaN();
  double force_n = 0;  ///< of the last tick
  BreachWatch breaches;
  RegionMemory region;
  StandoffMemory standoff;
  GuidanceMemory guidance;
};

/// What all fixtures keep from one tick to the next.
struct FixturesMemory {
  std::uint64_t generation = 0;
  bool placed = false;          ///< there was a last tick
  Vec3 hip_m_in_world;          ///< of the last tick
  Vec3 left_guidance_n;         ///< of guidance fixtures that are gone, on its way to zero
  Vec3 law_place_m_in_world;    ///< of the last contact with the law's surface ...
  Vec3 law_normal_in_world;     ///< ... and its normal; zero: there was none
  double depth_share = 1;       ///< FixtureInput::depth_share of the last tick
  std::uint32_t refreshed = 0;  ///< fixture whose distance was computed last for its own sake
  std::array<FixtureMemory, kMaxFixtures> fixtures;
};
static_assert(std::is_trivially_copyable_v<FixturesMemory>);

/// Input of one tick of all fixtures.
struct FixtureInput {
  const FixtureSet& set;
  const Scene& scene;
  Vec3 hip_m_in_world;  ///< finite
  Vec3 velocity_m_per_s_in_world;
  const LiveParameters& parameters;
  const ForceSample& law;    ///< force of the law in this tick
  bool surface_law = false;  ///< it comes from the law `surface`
  double frame_age_s = 0;    ///< see LawInput
  double depth_share = 1;    ///< share of the force of fixtures that fade without depth, 0..1
  std::int64_t now_ns = 0;   ///< CLOCK_MONOTONIC
  double period_s = 0;
  bool engages = false;      ///< the force begins to be exerted in this tick: guidance fades in anew
  double lag_damping_s = 0;  ///< damping per stiffness that the loop's lag requires
  /// Largest stiffness that is stable; infinite: it is not to be limited.
  double max_stiffness_n_per_m = std::numeric_limits<double>::infinity();
  /// Largest damping that is stable, in addition to the law's.
  double max_damping_n_s_per_m = std::numeric_limits<double>::infinity();
  double law_stiffness_n_per_m = 0;  ///< largest that the law's contact can have
};

/// Computes the forces of all virtual fixtures, as they are exerted: the stiffness limit is applied.
///
/// Each forbidden region has a potential of its own: that of a spring that saturates, over the HIP's depth in
/// this region alone (forbidden_region.h, standoff.h). The force is the negative gradient of the sum of all
/// potentials and that of the live surface, so whatever the stiffnesses are, no closed path of the HIP gains
/// energy, a region holds behind a softer one as it does alone, and nothing far away has an effect.
///
/// The stiffness limit acts on each spring's stiffness and never on its largest force. What can act at one
/// place together counts together: the largest eigenvalue of the sum of K n n^T (joint_stiffness.h).
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
    Vec3 proxy_m_in_world;         ///< of the region that pushes most; the HIP while none does
    std::uint32_t in_contact = 0;  ///< bit n: fixture n exerts a force
    bool holds = false;            ///< a forbidden region exerts a force
    std::int32_t nearest = -1;     ///< forbidden region nearest to the HIP
    double distance_m = std::numeric_limits<double>::infinity();  ///< from the HIP to its boundary
    double stored_j = 0;                                          ///< in the springs of the forbidden regions
    double guidance_j = 0;                                        ///< in the springs of the guidance fixtures
    double changes_j = 0;   ///< work done on these springs by regions that grew, or whose stiffness changed
    Vec3 standoff_force_n;  ///< part of spring_force_n ...
    double standoff_j = 0;  ///< ... and of stored_j that comes from stand-offs
    double standoff_power_w = 0;  ///< exerted on the HIP by stand-offs that move with their surface
    /// Bound of the change of spring_force_n per displacement of the HIP since the last tick, while proxies
    /// move no farther.
    double steepest_n_per_m = 0;
    double damping_n_s_per_m = 0;  ///< of the regions that exert a force, added up
    /// Share of the law's stiffness that may act together with fixtures, 0..1.
    double law_share = 1;
    bool redefined = false;  ///< the set is another one than in the last tick
  };

  Output step(const Input& input) HAPTICD_RT;

  /// Forgets all proxies and places; the next tick begins as if all fixtures were new.
  void release() HAPTICD_RT { memory_ = {}; }

  /// Returns what the fixture at this place of the set does.  RT: safe.
  FixtureState stateOf(std::size_t place) const noexcept;

  const Memory& memory() const noexcept { return memory_; }
  void restore(const Memory& memory) noexcept { memory_ = memory; }

 private:
  class Tick;

  Memory memory_;
};

}  // namespace hapticd::rt
