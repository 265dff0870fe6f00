// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "rt/base/latency_histogram.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/channels/handle_channel.h"
#include "rt/channels/spsc_ring.h"
#include "rt/channels/triple_buffer.h"
#include "rt/fixtures/fixture.h"
#include "rt/fixtures/fixture_state.h"
#include "rt/laws/automatic_stiffness.h"
#include "rt/laws/force_law.h"
#include "rt/laws/law_table.h"
#include "rt/safety/latency_probe.h"
#include "rt/safety/stiffness_limit.h"
#include "rt/tissue/tissue.h"

namespace hapticd::rt {

/// Operating mode of the force loop.
enum class Mode : std::uint8_t {
  starting,  ///< no tick yet
  idle,      ///< running, no force commanded
  engaged,   ///< the only mode that commands a force other than zero
  holding,   ///< engaged, but the force is held at zero or on its way there; ends without a request
  faulted,   ///< a fault that a person must look at; Disengage clears it
};

constexpr auto wordsOf(Mode) {
  return words<Mode>("starting", "idle", "engaged", "holding", "faulted");
}

/// Why the mode is what it is.
enum class Cause : std::uint8_t {
  none,
  requested,              ///< a client (or the configuration) engaged or disengaged
  no_scene,               ///< no depth frame has been modelled yet
  depth_stale,            ///< the newest scene is older than safety.depth_timeout_s
  handle_stale,           ///< the newest handle measurement is older than safety.handle_timeout_s
  handle_invalid,         ///< the handle's position is not finite or outside +-10 m
  force_not_finite,       ///< a force law computed a value that is not finite
  handle_too_fast,        ///< the hand moved faster than safety.max_handle_speed_m_per_s
  handle_clutched,        ///< the clutch is held
  handle_not_calibrated,  ///< the device does not know its position yet
  handle_replaced,        ///< the device was lost and reconnected: it engages again only on request
  outside_workspace,      ///< the HIP is farther from the world's origin than safety.workspace_radius_m
  inside_surface,         ///< engaging was refused because the HIP would have been in contact at once
  overrun_burst,          ///< too many ticks ended late
  /// The surface in contact has been nearer than the camera can measure for safety.depth_timeout_s.
  surface_too_near,
  handle_inconsistent,  ///< the device goes on claiming a velocity that its positions contradict
  energy_debt,          ///< the hand has got more energy than a spring at the limits can store (passivity.h)
};
constexpr auto wordsOf(Cause) {
  return words<Cause>("none", "requested", "no_scene", "depth_stale", "handle_stale", "handle_invalid",
                      "force_not_finite", "handle_too_fast", "handle_clutched", "handle_not_calibrated",
                      "handle_replaced", "outside_workspace", "inside_surface", "overrun_burst",
                      "surface_too_near", "handle_inconsistent", "energy_debt");
}
inline constexpr std::size_t kModeCount = enumeratorCount<Mode>();
inline constexpr std::size_t kCauseCount = enumeratorCount<Cause>();

/// A change of mode or cause.
struct Transition {
  std::uint64_t number = 0;  ///< 1 for the first since the start
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
  Mode from = Mode::starting;
  Mode to = Mode::starting;
  Cause cause = Cause::none;
};
inline constexpr std::size_t kTransitionsKept = 16;

/// Inputs and results of one tick; every tick is passed to the control thread through a ring.
struct Tick {
  std::uint64_t number = 0;     ///< 1 for the first
  std::int64_t planned_ns = 0;  ///< CLOCK_MONOTONIC, on the loop's time grid
  std::int64_t wakeup_latency_ns = 0;
  std::int64_t compute_ns = 0;
  std::uint64_t directive_generation = 0;  ///< of the Directive in effect
  std::uint64_t trace_dropped = 0;  ///< ticks dropped so far because the ring to the trace thread was full
  Mode mode = Mode::starting;
  Cause cause = Cause::none;
  bool slew_limited = false;
  bool magnitude_clamped = false;
  bool not_finite = false;  ///< the law computed a value that is not finite
  /// The force drops to zero without slew limit: a fault of the handle, or a stop that took too long.
  bool released = false;
  bool passivity_acted = false;    ///< passivity control added damping
  bool thermally_limited = false;  ///< the device is warm, so the allowed force is below the maximum
  bool outside_model = false;      ///< the HIP's neighbourhood was not modelled completely
  bool stopping = false;           ///< the loop is to end; no new engagement
  bool after_overrun = false;      ///< the previous tick ended late
  bool blending = false;           ///< a change of scene, law or parameters is still being blended in
  ForceLaw law{};                  ///< the law that the force comes from
  ContactState contact = ContactState::free;
  std::uint32_t points_used = 0;  ///< N of eq. (11)
  std::uint64_t scene_frame = 0;  ///< sequence number of the scene's frame; 0: none
  std::uint64_t scene_model = 0;  ///< number of the scene; 0: none
  std::int64_t scene_age_ns = 0;
  HandleState handle;  ///< the measurement used by the tick
  Vec3 hip_m_in_world;
  Vec3 proxy_m_in_world;  ///< the HIP for laws without a proxy
  double gain = 0;      ///< share of the blended force that is exerted: the engage ramp times stiffness_gain
  double energy_j = 0;  ///< energy that the hand has given to the box minus what it got back (passivity.h)
  /// Largest stable stiffness of the springs, given the loop's lag and the device.
  double stiffness_limit_n_per_m = 0;
  double stiffness_gain = 1;                           ///< share of the law's force that this limit permits
  StiffnessRule stiffness_rule = StiffnessRule::none;  ///< the rule that keeps the stiffness below k_s
  /// Contact damping at the hand required by the loop's lag, applied by the box or by the device.
  double contact_damping_n_s_per_m = 0;
  Vec3 law_force_n_in_world;
  Vec3 blended_force_n_in_world;   ///< clamped to the force limit and blended with that of the previous scene
  Vec3 damped_force_n_in_world;    ///< with the contact damping applied by the box
  Vec3 scaled_force_n_in_world;    ///< at the hand: times ramp, delay-dependent gain and force scale
  Vec3 passive_force_n_in_world;   ///< after passivity control
  Vec3 filtered_force_n_in_world;  ///< after the low-pass
  Vec3 slewed_force_n_in_world;    ///< after the slew limit
  Vec3 command_force_n_in_world;   ///< newtons at the hand: after clamp and finite check
  std::uint64_t fixture_generation = 0;   ///< of the FixtureSet in effect; 0: none
  std::uint32_t fixtures_in_contact = 0;  ///< bit n: fixture n of the set holds the HIP back or guides it
  std::int32_t nearest_fixture = -1;      ///< the forbidden region nearest to the HIP; -1: none
  /// From the HIP to that fixture's boundary, negative inside the forbidden region; infinite: none.
  double fixture_distance_m = std::numeric_limits<double>::infinity();
  Vec3 fixture_proxy_m_in_world;        ///< nearest allowed place; the HIP while no forbidden region acts
  Vec3 fixture_force_n_in_world;        ///< of all forbidden regions, part of damped_force_n_in_world
  Vec3 guidance_force_n_in_world;       ///< of all guidance fixtures, part of damped_force_n_in_world
  std::uint64_t tissue_generation = 0;  ///< of the TissueMap in effect; 0: none
  std::int32_t tissue_region = -1;      ///< region of the map in contact with the largest share; -1: none
  Vec3 cue_force_n_in_world;            ///< palpation cue at the hand, added after the low-pass
  double stiffness_n_per_m = 0;         ///< k_s in effect: configured or automatic
  /// What limits the automatic stiffness.
  StiffnessBound stiffness_bound = StiffnessBound::configured;
  /// Standard deviation of the modelled surface's distance at the proxy from frame to frame; 0: not known.
  double surface_noise_m = 0;
  /// Time by which forces act later than the device says, as the loop has measured it (latency_probe.h); 0:
  /// not at all, or not known.
  double hidden_latency_s = 0;
  /// Share of the forces that need depth, of the law and of fixtures that fade without it: below one while
  /// the camera is lost and other fixtures go on acting.
  double depth_share = 1;
};

/// Counters since the start of the loop.
struct LoopCounters {
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;         ///< ticks that ended after the next one was due
  std::uint64_t skipped_periods = 0;  ///< whole periods left out because of overruns
  std::uint64_t contact_ticks = 0;    ///< ticks in contact
  std::uint64_t outside_model_ticks = 0;
  std::uint64_t slew_limited_ticks = 0;
  std::uint64_t magnitude_clamped_ticks = 0;
  std::uint64_t not_finite_ticks = 0;
  std::uint64_t depth_stale_ticks = 0;
  std::uint64_t handle_stale_ticks = 0;
  std::uint64_t handle_invalid_ticks = 0;
  std::uint64_t passivity_ticks = 0;
  std::uint64_t thermally_limited_ticks = 0;
  std::uint64_t stiffness_limited_ticks = 0;
  std::uint64_t releases = 0;  ///< number of times the force was dropped because of a fault of the handle
};

/// The newest state of the force loop.
struct LoopState {
  Tick tick;
  LoopCounters counters;
  std::uint64_t directive_generation = 0;  ///< of the newest Directive that the loop has taken over
  std::uint64_t transition_count = 0;
  std::array<Transition, kTransitionsKept> transitions{};  ///< number n is at index n modulo the size
  std::array<std::uint64_t, kCauseCount> transitions_by_cause{};
  StiffnessRules stiffness_rules;  ///< of the newest tick that evaluated the law
  LatencyProbe::Result latency;    ///< of the newest measurement of the device's latency
  /// Of the set that tick.fixture_generation names.
  std::array<FixtureState, kMaxFixtures> fixtures{};
};

/// Requests of the control thread to the force loop, as one consistent set.
struct Directive {
  /// Incremented with each change; returned in LoopState::directive_generation.
  std::uint64_t generation = 0;
  bool engage = false;
  bool engage_inside = false;        ///< engage even if the HIP is already in contact
  std::uint64_t engage_request = 0;  ///< incremented with each new request; a refused request stays refused
  LiveParameters parameters;
};

inline constexpr std::size_t kTickRingCapacity = 4096;
using TickRing = SpscRing<Tick, kTickRingCapacity>;

/// The ring buffers 16 s, because cheap flash or a shared disk may block the writer for seconds.
inline constexpr std::size_t kTraceRingCapacity = 16384;
using TraceRing = SpscRing<Tick, kTraceRingCapacity>;

/// Channels between the force thread and the control thread.
struct ControlChannels {
  TripleBuffer<Directive> directive;  ///< written by the control thread
  TripleBuffer<LoopState> state;      ///< written by the force thread
  TickRing ticks;                     ///< pushed by the force thread
  TraceRing trace;                    ///< the same ticks, pushed by the force thread for the trace thread
  LatencyHistogram wakeup_latency;    ///< filled by the force thread
  LatencyHistogram compute_time;      ///< filled by the force thread
  FixtureChannel fixtures;            ///< written by the control thread
  TissueChannel tissue;               ///< written by the control thread
};

/// Real-time privileges that the loop obtained. Written once, before the first tick.
struct LoopPrivileges {
  bool realtime_scheduling = false;  ///< SCHED_FIFO at LoopParameters::priority
  bool memory_locked = false;
  int cpu = -1;  ///< CPU that the thread is pinned to; -1: not pinned
};

/// Returns true if the law acts on the HIP: points within reach or a surface holding the proxy.  RT: safe.
inline bool inContact(const Tick& tick) noexcept {
  return tick.points_used > 0 || isHeld(tick.contact);
}

static_assert(std::is_trivially_copyable_v<Tick> && std::is_trivially_copyable_v<LoopState> &&
              std::is_trivially_copyable_v<Directive>);

}  // namespace hapticd::rt
