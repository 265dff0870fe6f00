// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/conflicts.h"
#include "daemon/status/fixture_status.h"
#include "daemon/trace/format/trace_format.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "drivers/led/led_panel.h"
#include "rt/base/fields.h"
#include "rt/base/latency_histogram.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/loop/loop_state.h"

/// The status of the box as clients of the control API see it. The rows below each structure explain its
/// fields; what is null in JSON has no value here, or one that means that it is not known.
namespace hapticd::daemon {

struct Ball {
  rt::Vec3 centre_m;
  double radius_m = 0;
};

/// Counters of the scene thread.
struct SceneStatus {
  std::uint64_t frames = 0;
  std::uint64_t models = 0;
  std::uint64_t remodels = 0;
  std::uint32_t points = 0;
  std::uint64_t points_over_capacity = 0;
  std::uint64_t skipped_frames = 0;
  std::int64_t last_model_ns = 0;
  double frame_rate_hz = 0;
  std::optional<Ball> ball;
};
template <std::same_as<SceneStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(frames, "Frames taken over from the camera"),
      HAPTICD_FIELD(models, "Models of the scene built").counter("scene_models"),
      HAPTICD_FIELD(remodels, "Models built again because the interaction point left the modelled ball")
          .counter("scene_remodels"),
      HAPTICD_FIELD(points, "Points in the newest model").gauge("scene_points"),
      HAPTICD_FIELD(points_over_capacity, "Points dropped because a model was full")
          .counter("scene_points_over_capacity"),
      HAPTICD_FIELD(skipped_frames, "Frames that a newer one replaced before they were modelled")
          .counter("scene_skipped_frames"),
      HAPTICD_FIELD(last_model_ns, "Time taken to build the newest model").gauge("scene_model_seconds"),
      HAPTICD_FIELD(frame_rate_hz, "Depth frames per second").gauge("scene_frame_rate_hertz"),
      HAPTICD_FIELD(ball,
                    "Centre of the ball of space that the newest model holds, metres, world frame; null: the "
                    "model holds the whole depth frame, or there is none yet")
          .named("ballCentreMInWorld")
          .shownAs([](const auto& scene) {
            return scene.ball ? std::optional(scene.ball->centre_m) : std::nullopt;
          }),
      HAPTICD_FIELD(ball, "Radius of that ball").named("ballRadiusM").shownAs([](const auto& scene) {
        return scene.ball ? std::optional(scene.ball->radius_m) : std::nullopt;
      })};
}

/// Summary of force and contact over the ticks since the previous summary.
struct WindowStatus {
  std::uint64_t ticks = 0;
  std::uint64_t contact_ticks = 0;
  std::optional<double> min_force_n;
  std::optional<double> max_force_n;
  std::optional<std::int64_t> max_wakeup_latency_ns;
  std::optional<rt::LatencySummary> wakeup_latency;
  std::optional<rt::LatencySummary> compute_time;
};
template <std::same_as<WindowStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(ticks, "How many"),
      HAPTICD_FIELD(contact_ticks, "In contact"),
      HAPTICD_FIELD(min_force_n, "Smallest magnitude of the commanded force; null without ticks"),
      HAPTICD_FIELD(max_force_n, "Largest magnitude of the commanded force; null without ticks"),
      HAPTICD_FIELD(max_wakeup_latency_ns, "Longest wake-up latency; null without ticks"),
      HAPTICD_FIELD(wakeup_latency,
                    "From the planned to the actual start of these ticks; null without ticks"),
      HAPTICD_FIELD(compute_time, "From the begin to the end of these ticks; null without ticks")};
}

/// The force law in use, and the reason for it.
struct LawStatus {
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  std::string reason;
  bool filtered = false;
  double expected_error_n = 0;
  double max_error_n = 0;
  double distance_m = 0;
  double hand_stiffness_n_per_m = 0;
};
template <std::same_as<LawStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(law, "The force law in use").named("chosen").states("force_law"),
      HAPTICD_FIELD(reason, "Why it is this one"),
      HAPTICD_FIELD(filtered, "Whether the law works on filtered depth"),
      HAPTICD_FIELD(expected_error_n, "Error measured for this law, filter and distance; null: not known")
          .shownAs([](const auto& law) { return rt::ifPositive(law.expected_error_n); }),
      HAPTICD_FIELD(max_error_n, "Largest error that force.law auto accepts"),
      HAPTICD_FIELD(distance_m, "Distance of the proxy from the camera; null: not known")
          .shownAs([](const auto& law) { return rt::ifPositive(law.distance_m); }),
      HAPTICD_FIELD(hand_stiffness_n_per_m,
                    "Stiffness at the hand, newtons per metre: the law's times both scales of the handle, "
                    "reduced as its delay requires")};
}

/// How an LED blinks; isLit() (indicators.h) defines the times.
enum class LedPattern { off, on, slow_blink, fast_blink, double_blink };
constexpr auto wordsOf(LedPattern) {
  return rt::words<LedPattern>("off", "on", "slow_blink", "fast_blink", "double_blink");
}

/// The pattern of each LED; the index is the value of its drivers::Led.
using LedPatterns = std::array<LedPattern, drivers::kLedCount>;

/// The pattern of an LED; nothing: it is not configured.
template <drivers::Led kLed>
constexpr auto patternOf(const auto& leds) {
  const auto led = static_cast<std::size_t>(kLed);
  return leds.panel.configured[led] ? std::optional(leds.patterns[led]) : std::nullopt;
}

struct IndicatorStatus {
  drivers::LedStatus panel;
  LedPatterns patterns{};
};
template <std::same_as<IndicatorStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(panel.state, "Whether they can be switched").named("state"),
      HAPTICD_FIELD(panel.detail, "Why they are absent or lost, and what to do; may be empty")
          .named("detail"),
      HAPTICD_FIELD(panel.identity, "Driver and chip").named("identity"),
      HAPTICD_FIELD(patterns, "slow_blink while starting, on while running; null: no such LED is configured")
          .named("power")
          .shownAs([](const auto& leds) { return patternOf<drivers::Led::power>(leds); }),
      HAPTICD_FIELD(patterns,
                    "off without a camera, on while it streams, double_blink when a frame was damaged within "
                    "the last second, fast_blink when it is lost; null: no such LED is configured")
          .named("camera")
          .shownAs([](const auto& leds) { return patternOf<drivers::Led::camera>(leds); }),
      HAPTICD_FIELD(
          patterns,
          "on while engaged and in contact with the surface or with a fixture, double_blink while "
          "engaged without contact and nearer to a forbidden region than proximity.warning_m or its "
          "own warning_m, slow_blink while engaged otherwise, off otherwise; null: no such LED is "
          "configured")
          .named("contact")
          .shownAs([](const auto& leds) { return patternOf<drivers::Led::contact>(leds); }),
      HAPTICD_FIELD(patterns,
                    "slow_blink with a warning once started, double_blink while holding, fast_blink when "
                    "faulted, else off; null: no such LED is configured")
          .named("fault")
          .shownAs([](const auto& leds) { return patternOf<drivers::Led::fault>(leds); })};
}

using trace::TraceState;

/// Something that the box did with a trace without a request.
struct TraceNews {
  std::uint64_t number = 0;  ///< 1 for the first since the start
  bool warning = false;      ///< something was lost
  std::string action;        ///< one word, such as "delete"
  std::string trace;         ///< its name
  std::string text;          ///< a sentence with the name and the reason
};

/// The state of tracing: what is recorded, what was lost, and how much space is left.
struct TraceStatus {
  TraceState state = TraceState::off;
  std::string detail;
  std::vector<std::string> problems;
  std::string name;
  std::uint64_t ticks = 0;
  std::uint64_t bytes = 0;
  double duration_s = 0;
  std::uint64_t ticks_lost = 0;
  std::uint64_t records_lost = 0;
  std::uint64_t depth_frames = 0;
  std::uint64_t depth_frames_lost = 0;
  std::uint64_t traces = 0;
  std::uint64_t deleted = 0;
  std::uint64_t recovered = 0;
  std::uint64_t dumps = 0;
  std::string last_dump;
  double flight_recorder_s = 0;
  std::uint64_t folder_bytes = 0;
  std::optional<std::uint64_t> free_bytes;
  std::optional<std::uint64_t> limit_bytes;
  std::string next_deleted;
  std::vector<TraceNews> news;
};
template <std::same_as<TraceStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(state, "State of the trace: whether one is written").states("trace_state"),
      HAPTICD_FIELD(detail, "Why it waits, and what to do; may be empty"),
      HAPTICD_FIELD(problems,
                    "What failed apart from the recording itself (a dump of the flight recorder, the "
                    "recovery after a crash, a deletion) or is about to fail (the folder is nearly full, the "
                    "disk does not respond), each with its remedy"),
      HAPTICD_FIELD(name, "Name of the trace being written; empty: none"),
      HAPTICD_FIELD(ticks, "Ticks in it"),
      HAPTICD_FIELD(bytes, "Its size on the disk"),
      HAPTICD_FIELD(duration_s, "Since its beginning"),
      HAPTICD_FIELD(ticks_lost,
                    "Ticks that are in no file although a trace was requested; those lost while the disk "
                    "does not respond are counted at once")
          .counter("trace_ticks_lost"),
      HAPTICD_FIELD(records_lost, "Models and events dropped for lack of space")
          .counter("trace_records_lost"),
      HAPTICD_FIELD(depth_frames, "Raw depth frames in it"),
      HAPTICD_FIELD(depth_frames_lost, "Depth frames not recorded, because the disk was too slow")
          .counter("trace_depth_frames_lost"),
      HAPTICD_FIELD(traces, "Finished traces").counter("traces_finished"),
      HAPTICD_FIELD(deleted, "Traces deleted because of trace.max_folder_mb").counter("traces_deleted"),
      HAPTICD_FIELD(recovered, "Traces that a crash had left open, finished at the start")
          .counter("traces_recovered"),
      HAPTICD_FIELD(dumps, "Times that the flight recorder was written out").counter("trace_dumps"),
      HAPTICD_FIELD(last_dump, "Name of its newest trace; empty: none"),
      HAPTICD_FIELD(flight_recorder_s, "Duration of the ticks that it holds now"),
      HAPTICD_FIELD(folder_bytes, "Size of all traces").gauge("trace_folder_bytes"),
      HAPTICD_FIELD(free_bytes, "Free space on the disk of the traces; null: not known")
          .gauge("trace_free_bytes"),
      HAPTICD_FIELD(limit_bytes,
                    "Largest size of all traces together, trace.max_folder_mb; null: no limit, so that no "
                    "trace is deleted without a request")
          .named("folderLimitBytes")
          .gauge("trace_folder_limit_bytes"),
      HAPTICD_FIELD(next_deleted, "Name of the next trace to be deleted at the limit; empty: none"),
      HAPTICD_FIELD(news, "Events of the journal").hidden()};
}

/// Statistics of the thread that serves the control API.
struct ControlStatus {
  std::int64_t longest_gap_ns = 0;
  std::uint64_t ticks_lost = 0;
  std::uint64_t connections = 0;
  std::uint64_t refused_connections = 0;
  std::uint64_t log_entries_lost = 0;
  std::uint64_t notifications_lost = 0;
};
template <std::same_as<ControlStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(longest_gap_ns,
                    "Longest time between two periods of the thread that serves these calls, which are 5 ms; "
                    "the watchdog of the service manager is fed in them")
          .gauge("control_longest_gap_seconds"),
      HAPTICD_FIELD(ticks_lost,
                    "Ticks lost because the thread was too slow: they are missing in the windows of Monitor, "
                    "not in traces")
          .counter("control_ticks_lost"),
      HAPTICD_FIELD(connections, "Clients that are connected").gauge("control_connections"),
      HAPTICD_FIELD(refused_connections, "Connections refused because there were too many")
          .counter("control_refused_connections"),
      HAPTICD_FIELD(
          log_entries_lost,
          "Entries of the log that nothing took, because the terminal, the pipe or the journal behind "
          "standard error is not read: they are written nowhere. Methods are answered all the same")
          .counter("control_log_entries_lost"),
      HAPTICD_FIELD(notifications_lost,
                    "Notifications and feeds of the watchdog that the service manager did not take in time")
          .counter("control_notifications_lost")};
}

/// What a reload has loosened if it is confirmed, or if the box is disengaged. Until then everything that it
/// names stays as it was.
struct PendingReload {
  std::uint64_t number = 0;
  std::vector<config::Loosening> loosenings;

  friend bool operator==(const PendingReload&, const PendingReload&) = default;
};
template <std::same_as<PendingReload> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{HAPTICD_FIELD(number, "Number of the reload, for the confirmation"),
                    HAPTICD_FIELD(loosenings, "What stays as it is until then").named("held")};
}

/// Counts by words, in the order of the words.
using CountsByWord = std::vector<std::pair<std::string_view, std::uint64_t>>;

/// Changes of mode and cause by the cause that they led to.
inline CountsByWord countsByCause(const rt::LoopState& state) {
  CountsByWord counts;
  for (std::size_t cause = 0; cause < state.transitions_by_cause.size(); ++cause) {
    counts.emplace_back(rt::kWords<rt::Cause>[cause], state.transitions_by_cause[cause]);
  }
  return counts;
}

/// The newest changes, the oldest first.
inline std::vector<rt::Transition> newestTransitions(const rt::LoopState& state) {
  const std::uint64_t kept = std::min<std::uint64_t>(state.transition_count, rt::kTransitionsKept);
  std::vector<rt::Transition> newest;
  for (std::uint64_t number = state.transition_count - kept + 1; number <= state.transition_count; ++number) {
    newest.push_back(state.transitions[number % rt::kTransitionsKept]);
  }
  return newest;
}

/// What a loop's state says of changes.
struct TransitionsOf {
  const rt::LoopState& state;
};
template <std::same_as<TransitionsOf> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{HAPTICD_FIELD(state.transition_count, "Changes of the mode or its cause")
                        .named("count")
                        .counter("loop_transitions"),
                    HAPTICD_FIELD(state.transitions_by_cause, "By the cause of the mode they led to")
                        .named("byCause")
                        .shownAs([](const auto& of) { return countsByCause(of.state); }),
                    HAPTICD_FIELD(state.transitions, "The newest, at most 16, the oldest first")
                        .named("newest")
                        .shownAs([](const auto& of) { return newestTransitions(of.state); })};
}

/// The force loop.
struct LoopStatus {
  rt::LoopState state;
  rt::LoopPrivileges privileges;
  double rate_hz = 0;
  rt::LatencySummary wakeup_latency;
  rt::LatencySummary compute_time;
  std::uint64_t trace_ticks_dropped = 0;
  std::optional<std::uint64_t> page_faults;
};
template <std::same_as<LoopStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(rate_hz, "Ticks per second over the last second").gauge("loop_rate_hertz"),
      HAPTICD_FIELD(privileges.realtime_scheduling, "Whether it runs under SCHED_FIFO")
          .named("realtimeScheduling"),
      HAPTICD_FIELD(privileges.memory_locked, "Whether its memory cannot be paged out").named("memoryLocked"),
      HAPTICD_FIELD(privileges.cpu, "The CPU it is pinned to; null: not pinned")
          .named("cpu")
          .shownAs([](const auto& loop) {
            return loop.privileges.cpu >= 0 ? std::optional(loop.privileges.cpu) : std::nullopt;
          }),
      HAPTICD_FIELD(state.directive_generation, "Generation of the newest directive that it has taken over")
          .named("directiveGeneration"),
      HAPTICD_FIELD(wakeup_latency, "From the planned to the actual beginning of a tick")
          .summary("loop_wakeup_latency_seconds"),
      HAPTICD_FIELD(compute_time, "From the beginning to the end of a tick").summary("loop_compute_seconds"),
      HAPTICD_FIELD(state.counters, "Since the start").named("counters"),
      HAPTICD_FIELD(state.transitions, "Changes of the mode")
          .named("transitions")
          .shownAs([](const auto& loop) { return TransitionsOf{loop.state}; }),
      HAPTICD_FIELD(trace_ticks_dropped, "Ticks lost because the ring to the trace thread was full")
          .counter("loop_trace_ticks_dropped"),
      HAPTICD_FIELD(page_faults,
                    "Page faults of the thread of the force loop since its first tick; null: not known")
          .counter("loop_page_faults")};
}

/// The whole status of the box at one moment, as clients see it.
struct BoxStatus {
  LoopStatus loop;
  std::vector<std::string> warnings;
  std::string version;
  std::string kernel;
  double uptime_s = 0;
  drivers::CameraStatus camera;
  SceneStatus scene;
  drivers::HandleStatus handle;
  LawStatus law;
  IndicatorStatus leds;
  TraceStatus trace;
  ControlStatus control;
  FixtureStatus fixtures;
  std::vector<FrameStatus> frames;
  TissueStatus tissue;
  std::optional<PendingReload> pending_reload;
};
template <std::same_as<BoxStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(loop.state.tick.mode, "What the force loop does").named("mode").states("mode"),
      HAPTICD_FIELD(loop.state.tick.cause, "Why the mode is what it is").named("cause"),
      HAPTICD_FIELD(warnings,
                    "What is wrong with the box now, each with its remedy: all of it, so that a client needs "
                    "no rule of its own. An event of the kind warning says when each begins and ends"),
      HAPTICD_FIELD(version, "Version of hapticd"),
      HAPTICD_FIELD(kernel, "Version of the Linux kernel"),
      HAPTICD_FIELD(uptime_s, "Since the start of the daemon").gauge("uptime_seconds"),
      HAPTICD_FIELD(loop, "The force loop"),
      HAPTICD_FIELD(loop.state.tick, "The newest tick").named("tick"),
      HAPTICD_FIELD(loop.state.stiffness_rules, "What limits the automatic stiffness").named("stiffness"),
      HAPTICD_FIELD(loop.state.latency, "How late forces act; null: it has not been measured")
          .named("deviceLatency")
          .shownAs([](const auto& box) {
            return box.loop.state.latency.number == 0 ? std::nullopt : std::optional(box.loop.state.latency);
          }),
      HAPTICD_FIELD(camera, "The depth camera"),
      HAPTICD_FIELD(scene, "The model of what the camera sees"),
      HAPTICD_FIELD(handle, "The haptic handle"),
      HAPTICD_FIELD(law, "The force law in use"),
      HAPTICD_FIELD(leds, "The LEDs"),
      HAPTICD_FIELD(trace, "The traces"),
      HAPTICD_FIELD(control, "The thread that serves these calls"),
      HAPTICD_FIELD(fixtures, "The virtual fixtures"),
      HAPTICD_FIELD(frames, "The frames that move in the world, in the order of the configuration"),
      HAPTICD_FIELD(tissue, "The tissue regions"),
      HAPTICD_FIELD(pending_reload,
                    "A reload of the configuration that waits for confirmation; null: none does")};
}

}  // namespace hapticd::daemon
