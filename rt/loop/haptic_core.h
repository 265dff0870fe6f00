// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/channels/handle_channel.h"
#include "rt/fixtures/fixture_forces.h"
#include "rt/laws/automatic_stiffness.h"
#include "rt/laws/force_blend.h"
#include "rt/laws/force_laws.h"
#include "rt/loop/loop_state.h"
#include "rt/loop/supervisor.h"
#include "rt/safety/hidden_latency.h"
#include "rt/safety/passivity.h"
#include "rt/safety/safety_chain.h"
#include "rt/scene/scene.h"
#include "rt/tissue/palpation_cue.h"
#include "rt/tissue/tissue_contact.h"

namespace hapticd::rt {

/// One force tick without clock and channels: it maps inputs to a force by combining supervisor, law and
/// safety chain. Called by the force loop and by offline tools.
/// Thread: one.  RT: step() is safe.
class HapticCore {
 public:
  /// `point_capacity`: capacity of the scenes to be evaluated.  RT: not safe (allocates).
  explicit HapticCore(std::size_t point_capacity) : laws_(point_capacity) {}

  using Input = Supervisor::Input;

  /// Identifies the origin of a force; when it changes, the force is blended.
  struct Origin {
    std::uint64_t model = 0;  ///< 0: none
    ForceLaw law{};
    SpringParameters springs;  ///< stiffness 0: automatic, which changes too slowly to be blended
    ContactParameters contact;
    bool held = false;
    std::uint64_t fixtures = 0;           ///< FixtureSet::generation
    std::uint64_t tissue_generation = 0;  ///< 0: no regions
    friend bool operator==(const Origin&, const Origin&) = default;
  };
  /// The inputs that the previous force was computed from.
  struct Before {
    Vec3 hip_m_in_world;
    Vec3 velocity_m_per_s_in_world;
    Vec3 force_n_in_world;
    double gain = 0;
    double mode_gain = 0;       ///< Supervisor::gain(), part of `gain`
    Vec3 law_force_n_in_world;  ///< no longer than the largest force
    double fixture_j = 0;       ///< energy in the springs of the forbidden regions
    double guidance_j = 0;
    double fixture_changes_j = 0;
    Vec3 standoff_force_n_in_world;
    double standoff_j = 0;
    double standoff_power_w = 0;   ///< these five: see FixtureForces::Output
    double law_j = 0;              ///< energy in the law's springs, which saturate at the largest force
    double stiffness_n_per_m = 0;  ///< k_s in effect, times Evaluation::share
    std::int64_t handle_ns = 0;    ///< HandleState::time_ns
  };
  /// What the law's proxy does with the motions of the HIP.
  struct LawGrip {
    ProxyGrip grip;
    Vec3 proxy_m_in_world;    ///< of the last tick ...
    std::uint64_t model = 0;  ///< ... and the scene that held it; 0: none did
  };
  /// What a tick passes to the next one, besides what the laws keep.
  struct State {
    MovingFrames frames;
    FixtureForces fixtures;
    ForceBlend blend;
    Origin origin;
    Before before;
    SafetyChain safety;
    Supervisor supervisor;
    StiffnessShare stiffness_share;  ///< of the law's springs
    Vec3 held_force_n_in_world;      ///< from the last tick whose neighbourhood was modelled
    double outside_model_s = 0;      ///< time since that tick
    bool too_near = false;           ///< ForceSample::too_near of that tick
    double law_share = 1;            ///< FixtureForces::Output::law_share of the previous tick
    LawGrip law_grip;
    LawEntry law_entry;
    ForceLaw law{};  ///< of the last tick whose neighbourhood was modelled
    EnergyDebt debt;
    std::int64_t last_ns = 0;  ///< time of the previous tick; 0: none
    HiddenLatency latency;
    bool exerting = false;  ///< the mode was engaged in the previous tick
    TissueContact tissue;
    PalpationCue cue;
    AutomaticStiffness stiffness;
  };
  /// All that the next force depends on. A core restored from another core's memory continues exactly as
  /// that one.
  struct Memory {
    ForceLaws::Memory laws;
    State state;
  };
  static_assert(std::is_trivially_copyable_v<Memory>);

  /// Computes a tick: all of its fields except number and timing.
  /// Errors: stale, missing or invalid input brings the force to zero, with a cause and within the time
  /// stated in docs/faults.md.
  Tick step(const Input& input) HAPTICD_RT;

  /// Returns the law's force at a HIP, regardless of the mode and before any safety stage. `frame_age_s`: see
  /// LawInput::frame_age_s; 0: the moment shown by the scene.
  ForceSample lawForce(const Scene& scene, const Vec3& hip_m_in_world, const LiveParameters& parameters,
                       double frame_age_s = 0) HAPTICD_RT;

  /// Returns what the fixture at this place of the newest set does.
  FixtureState fixture(std::size_t place) const HAPTICD_RT { return state_.fixtures.stateOf(place); }
  /// Returns what the moving frame at this place of the newest set does.
  const FrameConduct& frame(std::size_t place) const HAPTICD_RT { return state_.frames.conduct(place); }
  /// Returns FramePose::number of the newest pose that was taken; 0: none.
  std::uint64_t newestPose() const HAPTICD_RT { return state_.frames.newestPose(); }
  /// Returns the result of the newest measurement of the device's latency.
  const LatencyProbe::Result& latency() const HAPTICD_RT { return state_.latency.result(); }

  /// Discards the proxy; the next force of a constraint law starts with the proxy at the HIP.
  void release() HAPTICD_RT {
    laws_.release();
    state_.fixtures.release();
  }

  Memory memory() const HAPTICD_RT { return {laws_.memory(), state_}; }
  void restore(const Memory& memory) HAPTICD_RT {
    laws_.restore(memory.laws);
    state_ = memory.state;
  }

  /// Returns the largest stiffness by each rule, at the last tick that evaluated the law.
  const StiffnessRules& stiffnessRules() const HAPTICD_RT { return state_.stiffness.rules(); }

  /// Returns the place around which the scene must be modelled for the next tick: the proxy of a constraint
  /// law, otherwise the HIP.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return laws_.focus_m_in_world(hip_m_in_world);
  }

 private:
  /// Requirements that follow from the loop's lag at this tick; in coordinates of the HIP unless stated
  /// otherwise.
  struct LagRules {
    double lag_s = 0;
    double damping_n_s_per_m = 0;          ///< contact damping of the HIP in addition to the law's own
    double across_n_s_per_m = 0;           ///< the same across the normal, where the proxy does not follow
    double fixture_damping_s = 0;          ///< the same for fixtures, per stiffness
    double largest_damping_n_s_per_m = 0;  ///< at the hand
    double fixture_stiffness_n_per_m = 0;  ///< largest that is stable; infinite: it is not to be limited
  };

  /// What differs from the previous tick, beyond what the HIP's displacement explains.
  struct Change {
    bool inputs = false;   ///< scene, law, parameters or fixtures are other ones
    bool surface = false;  ///< they are, or the surface moved
  };

  /// The law's result and the contact at its proxy.
  struct Evaluation {
    ForceSample sample;
    LocalContact contact;
    JointStiffness grip{};  ///< ProxyGrip::across() of the law's proxy
    double share = 1;       ///< of the law's force that is exerted, see LawEntry and Tick::depth_share
    LeavingLaw left{};      ///< the law of the last tick, where this tick has another one
  };

  Evaluation evaluateLaw(const Input& input, Tick& tick) HAPTICD_RT;
  double load_n(const Before& before, const LiveParameters& parameters) const HAPTICD_RT;
  ForceSample forceOfLaw(const Input& input, const Tick& tick) HAPTICD_RT;
  LocalContact applyTissue(const Input& input, ForceSample& sample, Tick& tick) HAPTICD_RT;
  void enterLaw(const Input& input, const Tick& tick, Evaluation& evaluation) HAPTICD_RT;
  JointStiffness followGrip(const Input& input, const ForceSample& sample) HAPTICD_RT;
  LagRules lagRules(const Input& input, const Evaluation& evaluation, Tick& tick) HAPTICD_RT;
  FixtureForces::Output evaluateFixtures(const Input& input, const Evaluation& evaluation,
                                         const LagRules& rules, Tick& tick) HAPTICD_RT;
  Vec3 damp(const Input& input, const Evaluation& evaluation, const FixtureForces::Output& fixtures,
            const LagRules& rules, Tick& tick) const HAPTICD_RT;
  Change blend(const Input& input, const Evaluation& evaluation, const FixtureForces::Output& fixtures,
               Tick& tick) HAPTICD_RT;
  double unexplained_n(const Input& input, const LocalContact& contact, double fixture_stiffness_n_per_m,
                       const Vec3& force_n_in_world) const HAPTICD_RT;
  double fixtureWork_j(const Before& before, const Change& change, const Input& input,
                       const Vec3& hip_motion_m) const HAPTICD_RT;
  SafetyChain::Motion motionSince(const Before& before, const Change& change, const Input& input,
                                  const Evaluation& evaluation, const Tick& tick) const HAPTICD_RT;
  bool isInDebt(const Input& input, const Tick& tick) HAPTICD_RT;
  Vec3 knock(const Input& input) HAPTICD_RT;
  Vec3 cue(const Input& input, const Evaluation& evaluation, const Tick& tick) HAPTICD_RT;
  SafetyChain::Output computeCommand(const Input& input, const Supervisor::Obstacle& obstacle,
                                     Tick& tick) HAPTICD_RT;

  ForceLaws laws_;
  State state_;
};

}  // namespace hapticd::rt
