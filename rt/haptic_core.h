// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/force_blend.h"
#include "rt/force_laws.h"
#include "rt/handle_channel.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/safety_chain.h"
#include "rt/scene.h"
#include "rt/supervisor.h"

namespace hapticd::rt {

/// One force tick without clock and channels: inputs in, force out. Supervisor, law and safety chain come
/// together here; the force loop and the offline tools call it.
/// Thread: one.  RT: step() is safe.
class HapticCore {
 public:
  /// `point_capacity`: of the scenes to be felt.  RT: not safe (allocates).
  explicit HapticCore(std::size_t point_capacity) : laws_(point_capacity) {}

  using Input = Supervisor::Input;

  /// What the force before came from; a change of it is blended.
  struct Origin {
    std::uint64_t model = 0;  ///< 0: there was none
    ForceLaw law = ForceLaw::nearest_springs;
    SpringParameters springs;
    ContactParameters contact;
    bool held = false;
    friend bool operator==(const Origin&, const Origin&) = default;
  };
  /// What the force before was computed from.
  struct Before {
    Vec3 hip_m_in_world;
    Vec3 velocity_m_per_s_in_world;
    Vec3 force_n_in_world;
    double gain = 0;
  };
  /// All that a tick leaves to the next one and that the force depends on. A core that is given the memory of
  /// another one goes on as that one would have.
  struct Memory {
    ForceLaws::Memory laws;
    ForceBlend blend;
    Origin origin;
    Before before;
    SafetyChain safety;
    Supervisor supervisor;
    double stiffness_gain = 1;
    bool changed = false;  ///< the force comes from another scene, law or parameter set than the one before
    bool surface_moved = false;  ///< that, or the HIP's motion does not explain the force
    Vec3 held_force_n_in_world;  ///< of the last tick whose neighbourhood was modelled
    double outside_model_s = 0;  ///< since then
    bool too_near = false;       ///< of that tick's force
  };
  static_assert(std::is_trivially_copyable_v<Memory>);

  /// Fills everything of a Tick but its number and its timing.
  /// Errors: stale, missing and invalid input ends in force zero with a cause, at the pace that
  /// docs/faults.md states.
  Tick step(const Input& input) HAPTICD_RT;

  /// The law's force at a HIP, whatever the mode, before any safety stage. `frame_age_s`: as
  /// LawInput::frame_age_s; 0: at the moment that the scene shows.
  ForceSample lawForce(const Scene& scene, const Vec3& hip_m_in_world, const LiveParameters& parameters,
                       double frame_age_s = 0) HAPTICD_RT;

  /// Forgets the proxy: the next force of a constraint law begins with the proxy at the HIP.
  void release() HAPTICD_RT { laws_.release(); }

  Memory memory() const HAPTICD_RT {
    Memory memory = memory_;
    memory.laws = laws_.memory();
    return memory;
  }
  void restore(const Memory& memory) HAPTICD_RT {
    memory_ = memory;
    laws_.restore(memory.laws);
  }

  /// Around this place the next tick needs the scene modelled: the proxy of a constraint law, else the HIP.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return laws_.focus_m_in_world(hip_m_in_world);
  }

 private:
  /// What the loop's lag asks for at this tick, for the HIP unless it says otherwise.
  struct LagRules {
    double lag_s = 0;
    double damping_n_s_per_m = 0;  ///< of the HIP in contact, that the law does not bring in by itself
    double largest_damping_n_s_per_m = 0;  ///< at the hand
  };

  ForceSample feel(const Input& input, Tick& tick) HAPTICD_RT;
  LagRules lagRules(const Input& input, Tick& tick) HAPTICD_RT;
  Vec3 damp(const Input& input, const ForceSample& felt, const LagRules& rules, Tick& tick) const HAPTICD_RT;
  void blend(const Input& input, const Vec3& force_n_in_world, Tick& tick) HAPTICD_RT;
  double unexplained_n(const Input& input, const Vec3& force_n_in_world) const HAPTICD_RT;
  SafetyChain::Motion motionSince(const Before& before, const Input& input,
                                  const Vec3& surface_velocity_m_per_s) const HAPTICD_RT;
  SafetyChain::Output exert(const Input& input, const Supervisor::Obstacle& obstacle, Tick& tick) HAPTICD_RT;

  ForceLaws laws_;
  Memory memory_;
};

}  // namespace hapticd::rt
