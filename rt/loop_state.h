// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/force_law.h"
#include "rt/handle_channel.h"
#include "rt/latency_histogram.h"
#include "rt/parameters.h"
#include "rt/spsc_ring.h"
#include "rt/stiffness_limit.h"
#include "rt/triple_buffer.h"
#include "rt/vec3.h"
#include "rt/words.h"

namespace hapticd::rt {

enum class Mode : std::uint8_t {
  starting,  ///< no tick yet
  idle,      ///< running, no force commanded
  engaged,   ///< the only mode that commands a force other than zero
  holding,   ///< engaged, but something keeps the force at zero, or on its way there; it ends by itself
  faulted,   ///< something that a person must look at; Disengage clears it
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
  handle_stale,           ///< the newest measurement of the handle is older than safety.handle_timeout_s
  handle_invalid,         ///< the handle's position is not finite or outside +-10 m
  force_not_finite,       ///< a force law computed a number that is not finite
  handle_too_fast,        ///< the hand moved faster than safety.max_handle_speed_m_per_s
  handle_clutched,        ///< the person holds the clutch
  handle_not_calibrated,  ///< the device does not know yet where it is
  handle_replaced,        ///< the device was lost and came back: to be engaged again on request only
  outside_workspace,      ///< the HIP is farther from the world's origin than safety.workspace_radius_m
  inside_surface,         ///< engaging was refused because something would have been felt at once
  overrun_burst,          ///< too many ticks ended late
  surface_too_near,       ///< what is in contact has been nearer than the camera can measure for
                          ///< safety.depth_timeout_s
};
constexpr auto wordsOf(Cause) {
  return words<Cause>("none", "requested", "no_scene", "depth_stale", "handle_stale", "handle_invalid",
                      "force_not_finite", "handle_too_fast", "handle_clutched", "handle_not_calibrated",
                      "handle_replaced", "outside_workspace", "inside_surface", "overrun_burst",
                      "surface_too_near");
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

/// What one tick saw and did; every tick reaches the control thread through a ring.
struct Tick {
  std::uint64_t number = 0;     ///< 1 for the first
  std::int64_t planned_ns = 0;  ///< CLOCK_MONOTONIC, on the loop's grid
  std::int64_t wakeup_latency_ns = 0;
  std::int64_t compute_ns = 0;
  std::uint64_t directive_generation = 0;  ///< of the Directive that it obeyed
  std::uint64_t trace_dropped = 0;         ///< ticks that the ring to the trace had no room for, so far
  Mode mode = Mode::starting;
  Cause cause = Cause::none;
  bool slew_limited = false;
  bool magnitude_clamped = false;
  bool not_finite = false;                   ///< the law computed a number that is not finite
  bool released = false;                     ///< the force goes to zero at once: a fault of the handle, or a
                                             ///< stop that took too long
  bool passivity_acted = false;              ///< damping was brought in
  bool thermally_limited = false;            ///< the device is warm: less than the largest force is allowed
  bool outside_model = false;                ///< the HIP's neighbourhood was not modelled completely
  bool stopping = false;                     ///< the loop is to end: nobody is engaged any more
  bool after_overrun = false;                ///< the tick before ended late
  bool blending = false;                     ///< a change of scene, law or parameters is still coming in
  ForceLaw law = ForceLaw::nearest_springs;  ///< whose force it is
  ContactState contact = ContactState::free;
  std::uint32_t points_used = 0;  ///< N of eq. (11)
  std::uint64_t scene_frame = 0;  ///< sequence number of the frame felt, 0: none
  std::uint64_t scene_model = 0;  ///< number of the scene felt, 0: none
  std::int64_t scene_age_ns = 0;
  HandleState handle;  ///< what the tick read
  Vec3 hip_m_in_world;
  Vec3 proxy_m_in_world;  ///< the HIP where the law has no proxy
  double gain = 0;        ///< share of the blended force that is exerted: the ramp times stiffness_gain
  double energy_j = 0;    ///< that the hand has given to the box more than it got back (passivity.h)
  double stiffness_limit_n_per_m = 0;  ///< of the springs, for what the loop's lag and the device allow
  double stiffness_gain = 1;           ///< share of the law's force that this leaves
  StiffnessRule stiffness_rule = StiffnessRule::none;  ///< which rule keeps the stiffness below k_s
  double contact_damping_n_s_per_m =
      0;  ///< at the hand, that the loop's lag asks for; by the box or the device
  Vec3 law_force_n_in_world;
  Vec3 blended_force_n_in_world;   ///< cut to the force limit, and carried over from the scene before
  Vec3 damped_force_n_in_world;    ///< with the damping in contact that the box brings in
  Vec3 scaled_force_n_in_world;    ///< at the hand: with the ramp, for the handle's delay, by the force scale
  Vec3 passive_force_n_in_world;   ///< after passivity control
  Vec3 filtered_force_n_in_world;  ///< after the low-pass
  Vec3 slewed_force_n_in_world;    ///< after the slew limit
  Vec3 command_force_n_in_world;   ///< newtons at the hand: after clamp and finite check
};

/// What has been counted since the start of the loop.
struct LoopCounters {
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;         ///< ticks that ended after the next one was due
  std::uint64_t skipped_periods = 0;  ///< whole periods left out because of overruns
  std::uint64_t contact_ticks = 0;    ///< ticks with something to feel
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
  std::uint64_t releases = 0;  ///< times that the force was dropped for a fault of the handle
};

/// The newest state of the force loop.
struct LoopState {
  Tick tick;
  LoopCounters counters;
  std::uint64_t directive_generation = 0;  ///< of the newest Directive that the loop has taken over
  std::uint64_t transition_count = 0;
  std::array<Transition, kTransitionsKept> transitions{};  ///< number n is at n modulo the size
  std::array<std::uint64_t, kCauseCount> transitions_by_cause{};
};

/// What the control thread wants of the force loop, as one consistent set.
struct Directive {
  std::uint64_t generation = 0;  ///< +1 with each change; comes back as LoopState::directive_generation
  bool engage = false;
  bool engage_inside = false;        ///< also where something is felt at once
  std::uint64_t engage_request = 0;  ///< +1 for each to be decided on; what was refused once stays refused
  LiveParameters parameters;
};

inline constexpr std::size_t kTickRingCapacity = 4096;
using TickRing = SpscRing<Tick, kTickRingCapacity>;

/// Cheap flash, and a disk that is shared, keep a writer waiting for seconds; this is for 16 of them.
inline constexpr std::size_t kTraceRingCapacity = 16384;
using TraceRing = SpscRing<Tick, kTraceRingCapacity>;

/// What joins the force thread and the control thread.
struct ControlChannels {
  TripleBuffer<Directive> directive;  ///< control thread writes
  TripleBuffer<LoopState> state;      ///< force thread writes
  TickRing ticks;                     ///< force thread pushes
  TraceRing trace;                    ///< force thread pushes the same, for the trace thread
  LatencyHistogram wakeup_latency;    ///< force thread adds
  LatencyHistogram compute_time;      ///< force thread adds
};

/// What the loop could set up of what it was asked for. Written once, before the first tick.
struct LoopPrivileges {
  bool realtime_scheduling = false;  ///< SCHED_FIFO at LoopParameters::priority
  bool memory_locked = false;
  int cpu = -1;  ///< the CPU the thread is pinned to, -1: not pinned
};

/// True if there is something to feel.  RT: safe.
inline bool inContact(const Tick& tick) noexcept {
  return tick.points_used > 0 || isHeld(tick.contact);
}

static_assert(std::is_trivially_copyable_v<Tick> && std::is_trivially_copyable_v<LoopState> &&
              std::is_trivially_copyable_v<Directive>);

}  // namespace hapticd::rt
