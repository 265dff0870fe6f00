// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <type_traits>

#include "rt/base/fields.h"
#include "rt/base/latency_histogram.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/channels/external_force.h"
#include "rt/channels/handle_channel.h"
#include "rt/channels/spsc_ring.h"
#include "rt/channels/triple_buffer.h"
#include "rt/fixtures/fixture.h"
#include "rt/fixtures/fixture_state.h"
#include "rt/fixtures/moving_frame.h"
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
  frame_lost,           ///< a fixture needs a moving frame whose poses are missing, and its rule is `stop`
};
constexpr auto wordsOf(Cause) {
  return words<Cause>("none", "requested", "no_scene", "depth_stale", "handle_stale", "handle_invalid",
                      "force_not_finite", "handle_too_fast", "handle_clutched", "handle_not_calibrated",
                      "handle_replaced", "outside_workspace", "inside_surface", "overrun_burst",
                      "surface_too_near", "handle_inconsistent", "energy_debt", "frame_lost");
}
inline constexpr std::size_t kModeCount = enumeratorCount<Mode>();
inline constexpr std::size_t kCauseCount = enumeratorCount<Cause>();

/// A change of mode or cause.
struct Transition {
  std::uint64_t number = 0;
  std::int64_t time_ns = 0;
  Mode from = Mode::starting;
  Mode to = Mode::starting;
  Cause cause = Cause::none;
};
template <std::same_as<Transition> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{HAPTICD_FIELD(number, "1 for the first since the start"),
                    HAPTICD_FIELD(time_ns, "When, CLOCK_MONOTONIC"), HAPTICD_FIELD(from, "The mode before"),
                    HAPTICD_FIELD(to, "The mode after"), HAPTICD_FIELD(cause, "Why")};
}
inline constexpr std::size_t kTransitionsKept = 16;

/// Nothing for a law without a proxy.
template <typename Value>
std::optional<Value> ifItHasAProxy(const auto& tick, const Value& value) noexcept {
  return hasProxy(tick.law) ? std::optional(value) : std::nullopt;
}

/// Inputs and results of one tick; every tick is passed to the control thread through a ring. Its fields are
/// explained by the rows below; where these say null, `contact` is free, `proxy_m_in_world` the HIP,
/// `fixture_distance_m` infinite and `surface_noise_m` 0.
struct Tick {
  std::uint64_t number = 0;
  std::int64_t planned_ns = 0;
  std::int64_t wakeup_latency_ns = 0;
  std::int64_t compute_ns = 0;
  std::uint64_t directive_generation = 0;
  std::uint64_t trace_dropped = 0;
  Mode mode = Mode::starting;
  Cause cause = Cause::none;
  bool slew_limited = false;
  bool magnitude_clamped = false;
  bool not_finite = false;
  bool released = false;
  bool passivity_acted = false;
  bool thermally_limited = false;
  bool outside_model = false;
  bool stopping = false;
  bool after_overrun = false;
  bool blending = false;
  ForceLaw law{};
  ContactState contact = ContactState::free;
  std::uint32_t points_used = 0;
  std::uint64_t scene_frame = 0;
  std::uint64_t scene_model = 0;
  std::int64_t scene_age_ns = 0;
  HandleState handle;
  Vec3 hip_m_in_world;
  Vec3 proxy_m_in_world;
  double gain = 0;
  double energy_j = 0;
  double stiffness_limit_n_per_m = 0;
  double stiffness_gain = 1;
  StiffnessRule stiffness_rule = StiffnessRule::none;
  double contact_damping_n_s_per_m = 0;
  Vec3 law_force_n_in_world;
  Vec3 blended_force_n_in_world;
  Vec3 damped_force_n_in_world;
  Vec3 scaled_force_n_in_world;
  Vec3 passive_force_n_in_world;
  Vec3 filtered_force_n_in_world;
  Vec3 slewed_force_n_in_world;
  Vec3 command_force_n_in_world;
  std::uint64_t fixture_generation = 0;
  std::uint32_t fixtures_in_contact = 0;
  std::int32_t nearest_fixture = -1;
  double fixture_distance_m = std::numeric_limits<double>::infinity();
  Vec3 fixture_proxy_m_in_world;
  Vec3 fixture_force_n_in_world;
  Vec3 guidance_force_n_in_world;
  std::uint64_t tissue_generation = 0;
  std::int32_t tissue_region = -1;
  Vec3 cue_force_n_in_world;
  Vec3 external_force_n_in_world;
  double stiffness_n_per_m = 0;
  StiffnessBound stiffness_bound = StiffnessBound::configured;
  double surface_noise_m = 0;
  double hidden_latency_s = 0;
  double depth_share = 1;
  std::uint64_t frame_pose = 0;
};
template <std::same_as<Tick> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(number, "1 for the first"),
      HAPTICD_FIELD(planned_ns, "When it was due, CLOCK_MONOTONIC"),
      HAPTICD_FIELD(wakeup_latency_ns, "How much later than planned it began"),
      HAPTICD_FIELD(compute_ns, "How long it took"),
      HAPTICD_FIELD(directive_generation, "Generation of the directive in effect"),
      HAPTICD_FIELD(trace_dropped, "Ticks dropped so far because the ring to the trace thread was full")
          .hidden(),
      HAPTICD_FIELD(mode, "What the force loop does").hidden(),
      HAPTICD_FIELD(cause, "Why the mode is what it is").hidden(),
      HAPTICD_FIELD(slew_limited, "Whether the slew limit shortened the step of the force"),
      HAPTICD_FIELD(magnitude_clamped, "Whether the clamp shortened the force"),
      HAPTICD_FIELD(not_finite, "Whether the force law computed a number that is not finite"),
      HAPTICD_FIELD(
          released,
          "Whether the force is released to zero within three ticks, because of a fault of the handle"),
      HAPTICD_FIELD(passivity_acted, "Whether passivity control added damping"),
      HAPTICD_FIELD(thermally_limited,
                    "Whether the device is warm, so that the allowed force is below the maximum"),
      HAPTICD_FIELD(outside_model,
                    "Whether the neighbourhood of the interaction point was not modelled completely"),
      HAPTICD_FIELD(stopping, "Whether the loop is to end, so that it does not engage").hidden(),
      HAPTICD_FIELD(after_overrun, "Whether the previous tick ended late"),
      HAPTICD_FIELD(blending, "Whether a change of frame, law or parameters is still being blended in"),
      HAPTICD_FIELD(law, "The law that the force comes from"),
      HAPTICD_FIELD(contact, "Where the proxy of the laws proxy and surface is; null: the law has no proxy")
          .shownAs([](const auto& tick) { return ifItHasAProxy(tick, tick.contact); }),
      HAPTICD_FIELD(points_used, "Points that the force comes from; 0 for the law surface")
          .gauge("tick_points"),
      HAPTICD_FIELD(scene_frame, "Number of the depth frame that the force was computed from; 0: none"),
      HAPTICD_FIELD(scene_model, "Number of the model that the force was computed from; 0: none"),
      HAPTICD_FIELD(scene_age_ns, "Age of the depth frame that the force was computed from"),
      HAPTICD_FIELD(handle.position_m_in_world, "Position of the interaction point that the handle measured")
          .hidden(),
      HAPTICD_FIELD(handle.velocity_m_per_s_in_world,
                    "Velocity of the interaction point, metres per second, world frame")
          .named("hipVelocityMPerSInWorld"),
      HAPTICD_FIELD(handle.sequence, "Number of the measurement; 0: nothing measured yet").hidden(),
      HAPTICD_FIELD(handle.time_ns, "When the measurement was made, CLOCK_MONOTONIC").hidden(),
      HAPTICD_FIELD(handle.session, "Number of times that the device was opened or reconnected").hidden(),
      HAPTICD_FIELD(handle.condition, "Whether the measurement can be used").hidden(),
      HAPTICD_FIELD(handle.buttons, "Buttons of the handle; bit n: button n is held").named("buttons"),
      HAPTICD_FIELD(
          handle.delay_s,
          "From a motion of the hand to the force that responds to it, without the loop's own share"),
      HAPTICD_FIELD(handle.command_latency_ns,
                    "Time from writing the command that was sent to the device most recently until it was "
                    "sent; 0: none yet"),
      HAPTICD_FIELD(handle.damps, "Whether the device damps contact itself, so that the box does not"),
      HAPTICD_FIELD(handle.velocity_claim, "What became of a velocity that the handle claims"),
      HAPTICD_FIELD(handle.probes, "Whether the loop measures how late the device's link is").hidden(),
      HAPTICD_FIELD(handle.has_orientation, "Whether the device measures how it is held").hidden(),
      HAPTICD_FIELD(handle.has_gripper, "Whether the device measures a gripper").hidden(),
      HAPTICD_FIELD(handle.orientation_in_world.x, "").hidden(),
      HAPTICD_FIELD(handle.orientation_in_world.y, "").hidden(),
      HAPTICD_FIELD(handle.orientation_in_world.z, "").hidden(),
      HAPTICD_FIELD(handle.orientation_in_world.w,
                    "How the tool is held, as a unit quaternion x, y, z, w that maps its vectors to the "
                    "world; null: not measured")
          .named("orientationXyzw")
          .shownAs([](const auto& tick) {
            const Quaternion& q = tick.handle.orientation_in_world;
            return tick.handle.has_orientation ? std::optional(std::array{q.x, q.y, q.z, q.w}) : std::nullopt;
          }),
      HAPTICD_FIELD(handle.gripper_rad, "Opening angle of the gripper, radians; null: not measured")
          .shownAs([](const auto& tick) {
            return tick.handle.has_gripper ? std::optional(tick.handle.gripper_rad) : std::nullopt;
          }),
      HAPTICD_FIELD(hip_m_in_world, "The haptic interaction point (HIP), metres, world frame"),
      HAPTICD_FIELD(proxy_m_in_world, "The proxy, metres, world frame; null: the law has no proxy")
          .shownAs([](const auto& tick) { return ifItHasAProxy(tick, tick.proxy_m_in_world); }),
      HAPTICD_FIELD(gain, "Share of the law's force that is exerted: the engage ramp times stiffnessGain"),
      HAPTICD_FIELD(energy_j, "Energy that the hand has given to the box minus what it got back, joules")
          .gauge("tick_energy_joules"),
      HAPTICD_FIELD(
          stiffness_limit_n_per_m,
          "Largest stable stiffness, given the device and the delay of the handle, newtons per metre")
          .gauge("tick_stiffness_limit_newtons_per_metre"),
      HAPTICD_FIELD(stiffness_gain, "Share of the law's force that this limit permits")
          .gauge("tick_stiffness_gain_ratio"),
      HAPTICD_FIELD(stiffness_rule, "The rule that keeps the stiffness below force.stiffness_n_per_m"),
      HAPTICD_FIELD(contact_damping_n_s_per_m,
                    "Contact damping at the hand that the delay requires, newton seconds per metre")
          .gauge("tick_contact_damping_newton_seconds_per_metre"),
      HAPTICD_FIELD(law_force_n_in_world, "What the force law computed, newtons, world frame"),
      HAPTICD_FIELD(blended_force_n_in_world, "The same after the force limit and the blend"),
      HAPTICD_FIELD(damped_force_n_in_world, "The same with the contact damping"),
      HAPTICD_FIELD(scaled_force_n_in_world, "The same at the hand: times gain and handle.force_scale"),
      HAPTICD_FIELD(passive_force_n_in_world, "The same after passivity control"),
      HAPTICD_FIELD(filtered_force_n_in_world, "The same after the low-pass"),
      HAPTICD_FIELD(slewed_force_n_in_world, "The same after the slew limit"),
      HAPTICD_FIELD(command_force_n_in_world,
                    "The command: the force that the handle is to exert on the hand, newtons, in the axes of "
                    "the world frame"),
      HAPTICD_FIELD(fixture_generation, "Generation of the set of fixtures in effect; 0: none"),
      HAPTICD_FIELD(fixtures_in_contact,
                    "Bit n: fixture n of the set holds the interaction point back or guides it")
          .hidden(),
      HAPTICD_FIELD(nearest_fixture,
                    "Place in the set of the forbidden region nearest to the interaction point; -1: none")
          .hidden(),
      HAPTICD_FIELD(fixture_distance_m,
                    "From the interaction point to the boundary of the nearest forbidden region, negative "
                    "inside it; null: there is none"),
      HAPTICD_FIELD(fixture_proxy_m_in_world,
                    "The allowed place nearest to the interaction point, metres, world frame; the "
                    "interaction point itself while no forbidden region acts"),
      HAPTICD_FIELD(fixture_force_n_in_world,
                    "Force of all forbidden regions, newtons, world frame; a part of dampedForceNInWorld"),
      HAPTICD_FIELD(guidance_force_n_in_world,
                    "Force of all guidance fixtures, newtons, world frame; a part of dampedForceNInWorld"),
      HAPTICD_FIELD(tissue_generation, "Generation of the stiffness map in effect; 0: none"),
      HAPTICD_FIELD(tissue_region,
                    "Place in the map of the region in contact with the largest share; -1: none")
          .hidden(),
      HAPTICD_FIELD(cue_force_n_in_world,
                    "The palpation cue at the hand, newtons, world frame; added after the low-pass"),
      HAPTICD_FIELD(external_force_n_in_world,
                    "Force at the hand that another program wishes to add, newtons, world frame; its budgets "
                    "may let less of it act"),
      HAPTICD_FIELD(stiffness_n_per_m,
                    "Stiffness of the surface in effect, newtons per metre: configured or automatic")
          .gauge("tick_stiffness_newtons_per_metre"),
      HAPTICD_FIELD(stiffness_bound, "What limits the stiffness of the surface").states("stiffness_bound"),
      HAPTICD_FIELD(
          surface_noise_m,
          "Standard deviation of the surface's distance at the proxy from frame to frame; null: not known")
          .shownAs([](const auto& tick) { return ifPositive(tick.surface_noise_m); })
          .gauge("tick_surface_noise_metres"),
      HAPTICD_FIELD(hidden_latency_s,
                    "Time by which forces act later than the device says, as the box has measured it; 0: not "
                    "at all, or not known"),
      HAPTICD_FIELD(depth_share,
                    "Share of the forces that need depth: below one while the camera is lost and other "
                    "fixtures go on acting"),
      HAPTICD_FIELD(frame_pose, "Number of the newest pose of a moving frame that was taken; 0: none")};
}

/// Counters since the start of the loop.
struct LoopCounters {
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;
  std::uint64_t skipped_periods = 0;
  std::uint64_t contact_ticks = 0;
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
  std::uint64_t releases = 0;
};
template <std::same_as<LoopCounters> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(ticks, "Ticks of the force loop").counter("loop_ticks"),
      HAPTICD_FIELD(overruns, "Ticks that ended after the next one was due").counter("loop_overruns"),
      HAPTICD_FIELD(skipped_periods, "Whole periods left out because of overruns")
          .counter("loop_skipped_periods"),
      HAPTICD_FIELD(contact_ticks, "Ticks in contact").counter("loop_contact_ticks"),
      HAPTICD_FIELD(outside_model_ticks, "Ticks whose neighbourhood was not modelled completely")
          .counter("loop_outside_model_ticks"),
      HAPTICD_FIELD(slew_limited_ticks, "Ticks whose force was kept from changing too fast")
          .counter("loop_slew_limited_ticks"),
      HAPTICD_FIELD(magnitude_clamped_ticks, "Ticks whose force was reduced to the largest permitted one")
          .counter("loop_magnitude_clamped_ticks"),
      HAPTICD_FIELD(not_finite_ticks, "Ticks whose force was not finite").counter("loop_not_finite_ticks"),
      HAPTICD_FIELD(depth_stale_ticks, "Ticks with stale depth").counter("loop_depth_stale_ticks"),
      HAPTICD_FIELD(handle_stale_ticks, "Ticks with a stale measurement of the handle")
          .counter("loop_handle_stale_ticks"),
      HAPTICD_FIELD(handle_invalid_ticks, "Ticks with an impossible position of the handle")
          .counter("loop_handle_invalid_ticks"),
      HAPTICD_FIELD(passivity_ticks, "Ticks damped by passivity control").counter("loop_passivity_ticks"),
      HAPTICD_FIELD(thermally_limited_ticks, "Ticks with less force because the device is warm")
          .counter("loop_thermally_limited_ticks"),
      HAPTICD_FIELD(stiffness_limited_ticks, "Ticks with a force reduced for the delay of the handle")
          .counter("loop_stiffness_limited_ticks"),
      HAPTICD_FIELD(
          releases,
          "Number of times, not of ticks, that the force was released because of a fault of the handle")
          .counter("loop_releases")};
}

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
  std::array<FrameConduct, kMaxFrames> frames{};  ///< of the same set
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
  TripleBuffer<Directive> directive;    ///< written by the control thread
  TripleBuffer<LoopState> state;        ///< written by the force thread
  TickRing ticks;                       ///< pushed by the force thread
  TraceRing trace;                      ///< the same ticks, pushed by the force thread for the trace thread
  LatencyHistogram wakeup_latency;      ///< filled by the force thread
  LatencyHistogram compute_time;        ///< filled by the force thread
  FixtureChannel fixtures;              ///< written by the control thread
  FramePoseRing frame_poses;            ///< pushed by the control thread
  TissueChannel tissue;                 ///< written by the control thread
  ExternalForceChannel external_force;  ///< written by the control thread
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
