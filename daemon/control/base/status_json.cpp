// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/status_json.h"

#include <sys/utsname.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "config/settings/law_choice.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/interface_texts.h"
#include "rt/laws/law_table.h"

// Structured bindings take the structures apart, so that a field added to one of them does not compile here
// until it is shown.
namespace hapticd::daemon {
namespace {

OrderedJson vectorJson(const rt::Vec3& vector) {
  return {{"x", vector.x}, {"y", vector.y}, {"z", vector.z}};
}

OrderedJson finiteOrNull(double number) {
  return std::isfinite(number) ? OrderedJson(number) : OrderedJson();
}

OrderedJson textOrNull(const std::string& text) {
  return text.empty() ? OrderedJson() : OrderedJson(text);
}

OrderedJson latencyJson(const LatencySummary& latency) {
  const auto& [p50_ns, p99_ns, p999_ns, max_ns] = latency;
  return {{"p50Ns", p50_ns}, {"p99Ns", p99_ns}, {"p999Ns", p999_ns}, {"maxNs", max_ns}};
}

OrderedJson countersJson(const rt::LoopCounters& counters) {
  const auto& [ticks, overruns, skipped_periods, contact, outside_model, slew_limited, magnitude_clamped,
               not_finite, depth_stale, handle_stale, handle_invalid, passivity, thermally_limited,
               stiffness_limited, releases] = counters;
  return {{"ticks", ticks},
          {"overruns", overruns},
          {"skippedPeriods", skipped_periods},
          {"contactTicks", contact},
          {"outsideModelTicks", outside_model},
          {"slewLimitedTicks", slew_limited},
          {"magnitudeClampedTicks", magnitude_clamped},
          {"notFiniteTicks", not_finite},
          {"depthStaleTicks", depth_stale},
          {"handleStaleTicks", handle_stale},
          {"handleInvalidTicks", handle_invalid},
          {"passivityTicks", passivity},
          {"thermallyLimitedTicks", thermally_limited},
          {"stiffnessLimitedTicks", stiffness_limited},
          {"releases", releases}};
}

OrderedJson transitionsJson(const rt::LoopState& state) {
  OrderedJson by_cause = OrderedJson::object();
  for (std::size_t cause = 0; cause < state.transitions_by_cause.size(); ++cause) {
    by_cause[nameOf(static_cast<rt::Cause>(cause))] = state.transitions_by_cause[cause];
  }
  OrderedJson newest = OrderedJson::array();
  const std::uint64_t kept = std::min<std::uint64_t>(state.transition_count, rt::kTransitionsKept);
  for (std::uint64_t number = state.transition_count - kept + 1; number <= state.transition_count; ++number) {
    const auto& [its_number, time_ns, from, to, cause] = state.transitions[number % rt::kTransitionsKept];
    newest.push_back({{"number", its_number},
                      {"timeNs", time_ns},
                      {"from", nameOf(from)},
                      {"to", nameOf(to)},
                      {"cause", nameOf(cause)}});
  }
  return {{"count", state.transition_count}, {"byCause", by_cause}, {"newest", newest}};
}

/// Null for cameras that report nothing of themselves.
OrderedJson detailsJson(const drivers::CameraDetails& details) {
  const auto& [node, serial, firmware, format, width_px, height_px, rate_hz, temperature_c] = details;
  if (node.empty()) return {};
  return {
      {"node", node},         {"serial", serial},
      {"firmware", firmware}, {"format", format},
      {"widthPx", width_px},  {"heightPx", height_px},
      {"rateHz", rate_hz},    {"temperatureC", temperature_c ? OrderedJson(*temperature_c) : OrderedJson()}};
}

OrderedJson cameraJson(const drivers::CameraStatus& camera) {
  const auto& [state, detail, identity, frames, damaged_frames, lost_frames, advice, details] = camera;
  return {{"state", nameOf(state)},
          {"detail", detail},
          {"identity", identity},
          {"frames", frames},
          {"damagedFrames", damaged_frames},
          {"lostFrames", lost_frames},
          {"advice", advice},
          {"details", detailsJson(details)}};
}

OrderedJson sceneJson(const SceneStatus& scene) {
  const auto& [frames, models, remodels, points, points_over_capacity, skipped_frames, last_model_ns,
               frame_rate_hz, ball] = scene;
  return {{"frames", frames},
          {"models", models},
          {"remodels", remodels},
          {"points", points},
          {"pointsOverCapacity", points_over_capacity},
          {"skippedFrames", skipped_frames},
          {"lastModelNs", last_model_ns},
          {"frameRateHz", frame_rate_hz},
          {"ballCentreMInWorld", ball ? vectorJson(ball->centre_m) : OrderedJson()},
          {"ballRadiusM", ball ? OrderedJson(ball->radius_m) : OrderedJson()}};
}

OrderedJson lawJson(const LawStatus& law) {
  const auto& [chosen, reason, filtered, expected_error_n, max_error_n, distance_m, hand_stiffness_n_per_m] =
      law;
  return {{"chosen", config::nameOf(chosen)},
          {"reason", reason},
          {"filtered", filtered},
          {"expectedErrorN", expected_error_n > 0 ? OrderedJson(expected_error_n) : OrderedJson()},
          {"maxErrorN", max_error_n},
          {"distanceM", distance_m > 0 ? OrderedJson(distance_m) : OrderedJson()},
          {"handStiffnessNPerM", hand_stiffness_n_per_m}};
}

OrderedJson linkJson(const drivers::LinkStatus& link) {
  const auto& [sent, received, lost, duplicated, reordered, rejected, round_trip] = link;
  return {{"sent", sent},
          {"received", received},
          {"lost", lost},
          {"duplicated", duplicated},
          {"reordered", reordered},
          {"rejected", rejected},
          {"roundTrip", latencyJson(round_trip)}};
}

/// The noise itself is in the tick.
OrderedJson stiffnessJson(const rt::StiffnessRules& rules) {
  const auto& [ceiling, stability, device, noise, slew, surface] = rules;
  return {{"ceilingNPerM", finiteOrNull(ceiling)},
          {"stabilityNPerM", finiteOrNull(stability)},
          {"deviceNPerM", finiteOrNull(device)},
          {"noiseNPerM", finiteOrNull(noise)},
          {"slewNPerM", finiteOrNull(slew)},
          {"surfaceStepM", surface.step_m > 0 ? OrderedJson(surface.step_m) : OrderedJson()},
          {"noiseFrames", surface.frames}};
}

OrderedJson handleJson(const drivers::HandleStatus& handle) {
  const auto& [state, detail, identity, measurements, rejected, exerts_force, advice, link, scheduling,
               last_hop] = handle;
  return {{"state", nameOf(state)},
          {"present", state == drivers::HandlePresence::present},
          {"detail", detail},
          {"identity", identity},
          {"measurements", measurements},
          {"rejected", rejected},
          {"exertsForce", exerts_force},
          {"advice", advice},
          {"link", link ? linkJson(*link) : OrderedJson()},
          {"threadPriority", scheduling.priority},
          {"wantedThreadPriority", scheduling.requested_priority},
          {"lastHop", last_hop ? latencyJson(*last_hop) : OrderedJson()}};
}

OrderedJson ledsJson(const IndicatorStatus& leds) {
  const auto& [panel, patterns] = leds;
  const auto& [state, detail, identity, configured] = panel;
  OrderedJson json = {{"state", nameOf(state)}, {"detail", detail}, {"identity", identity}};
  for (std::size_t led = 0; led < drivers::kLedCount; ++led) {
    const bool is_configured = configured[led];
    json[nameOf(static_cast<drivers::Led>(led))] =
        is_configured ? OrderedJson(nameOf(patterns[led])) : OrderedJson();
  }
  return json;
}

OrderedJson traceJson(const TraceStatus& trace) {
  const auto& [state, detail, problems, name, ticks, bytes, duration_s, ticks_lost, records_lost,
               depth_frames, depth_frames_lost, traces, deleted, recovered, dumps, last_dump,
               flight_recorder_s, folder_bytes, free_bytes, limit_bytes, next_deleted, news] = trace;
  return {{"state", nameOf(state)},
          {"detail", detail},
          {"problems", OrderedJson(problems)},
          {"name", name},
          {"ticks", ticks},
          {"bytes", bytes},
          {"durationS", duration_s},
          {"ticksLost", ticks_lost},
          {"recordsLost", records_lost},
          {"depthFrames", depth_frames},
          {"depthFramesLost", depth_frames_lost},
          {"traces", traces},
          {"deleted", deleted},
          {"recovered", recovered},
          {"dumps", dumps},
          {"lastDump", last_dump},
          {"flightRecorderS", flight_recorder_s},
          {"folderBytes", folder_bytes},
          {"freeBytes", free_bytes ? OrderedJson(*free_bytes) : OrderedJson()},
          {"folderLimitBytes", limit_bytes ? OrderedJson(*limit_bytes) : OrderedJson()},
          {"nextDeleted", next_deleted}};
}

OrderedJson controlJson(const ControlStatus& control) {
  const auto& [longest_gap_ns, ticks_lost, connections, refused_connections, log_entries_lost,
               notifications_lost] = control;
  return {{"longestGapNs", longest_gap_ns},     {"ticksLost", ticks_lost},
          {"connections", connections},         {"refusedConnections", refused_connections},
          {"logEntriesLost", log_entries_lost}, {"notificationsLost", notifications_lost}};
}

OrderedJson conductJson(const FixtureConduct& conduct) {
  const auto& [name, configured_n_per_m, stiffness_n_per_m, force_n, distance_m, breach] = conduct;
  return {{"name", name},
          {"distanceM", finiteOrNull(distance_m)},
          {"forceN", force_n},
          {"stiffnessNPerM", stiffness_n_per_m},
          {"configuredStiffnessNPerM", configured_n_per_m},
          {"breaches", breach.number}};
}

OrderedJson fixturesJson(const FixtureStatus& fixtures) {
  const auto& [generation, count, enabled, in_contact, nearest, distance_m, warning, force_n,
               guidance_force_n, each] = fixtures;
  OrderedJson conducts = OrderedJson::array();
  for (const FixtureConduct& conduct : each) conducts.push_back(conductJson(conduct));
  return {{"generation", generation},
          {"count", count},
          {"enabled", enabled},
          {"inContact", OrderedJson(in_contact)},
          {"nearest", textOrNull(nearest)},
          {"distanceM", finiteOrNull(distance_m)},
          {"warning", warning},
          {"forceN", force_n},
          {"guidanceForceN", guidance_force_n},
          {"each", std::move(conducts)}};
}

OrderedJson tissueJson(const TissueStatus& tissue) {
  const auto& [generation, count, in_contact, feed] = tissue;
  const auto& [accepted, limited, outside] = feed;
  return {{"generation", generation},
          {"count", count},
          {"inContact", textOrNull(in_contact)},
          {"feed", {{"accepted", accepted}, {"limited", limited}, {"outside", outside}}}};
}

OrderedJson privilegesJson(const rt::LoopPrivileges& privileges) {
  const auto& [realtime_scheduling, memory_locked, cpu] = privileges;
  return {{"realtimeScheduling", realtime_scheduling},
          {"memoryLocked", memory_locked},
          {"cpu", cpu >= 0 ? OrderedJson(cpu) : OrderedJson()}};
}

/// The version of the kernel, which cannot change while the daemon runs.
const std::string& kernelRelease() {
  static const std::string release = [] {
    utsname names{};
    return std::string(::uname(&names) == 0 ? names.release : "");
  }();
  return release;
}

}  // namespace

/// Not shown here: mode and cause, which are at the top of the status; the ticks that the trace has lost,
/// which are counted in the loop's status; what only the recording of a handle needs; places of fixtures and
/// regions in their sets, whose names are in the status.
OrderedJson tickJson(const rt::Tick& tick) {
  const auto& [number, planned_ns, wakeup_latency_ns, compute_ns, directive_generation, trace_dropped, mode,
               cause, slew_limited, magnitude_clamped, not_finite, released, passivity_acted,
               thermally_limited, outside_model, stopping, after_overrun, blending, law, contact, points_used,
               scene_frame, scene_model, scene_age_ns, handle, hip, proxy, gain, energy_j, stiffness_limit,
               stiffness_gain, stiffness_rule, contact_damping, law_force, blended_force, damped_force,
               scaled_force, passive_force, filtered_force, slewed_force, command_force, fixture_generation,
               fixtures_in_contact, nearest_fixture, fixture_distance, fixture_proxy, fixture_force,
               guidance_force, tissue_generation, tissue_region, cue_force, stiffness, stiffness_bound,
               surface_noise, hidden_latency, depth_share] = tick;
  const auto& [handle_position, handle_velocity, handle_sequence, handle_time_ns, handle_session,
               handle_condition, buttons, delay_s, command_latency_ns, damps, velocity_source, probes] =
      handle;
  const bool has_proxy = rt::hasProxy(law);
  return {{"number", number},
          {"plannedNs", planned_ns},
          {"wakeupLatencyNs", wakeup_latency_ns},
          {"computeNs", compute_ns},
          {"slewLimited", slew_limited},
          {"magnitudeClamped", magnitude_clamped},
          {"notFinite", not_finite},
          {"released", released},
          {"passivityActed", passivity_acted},
          {"thermallyLimited", thermally_limited},
          {"energyJ", energy_j},
          {"stiffnessLimitNPerM", stiffness_limit},
          {"stiffnessGain", stiffness_gain},
          {"stiffnessRule", nameOf(stiffness_rule)},
          {"contactDampingNSPerM", contact_damping},
          {"outsideModel", outside_model},
          {"blending", blending},
          {"law", config::nameOf(law)},
          {"contact", has_proxy ? OrderedJson(nameOf(contact)) : OrderedJson()},
          {"pointsUsed", points_used},
          {"sceneFrame", scene_frame},
          {"sceneAgeNs", scene_age_ns},
          {"directiveGeneration", directive_generation},
          {"sceneModel", scene_model},
          {"afterOverrun", after_overrun},
          {"gain", gain},
          {"hipVelocityMPerSInWorld", vectorJson(handle_velocity)},
          {"buttons", buttons},
          {"handleDelayS", delay_s},
          {"handleDamps", damps},
          {"handleVelocitySource", nameOf(velocity_source)},
          {"hiddenLatencyS", hidden_latency},
          {"depthShare", depth_share},
          {"handleCommandLatencyNs", command_latency_ns},
          {"hipMInWorld", vectorJson(hip)},
          {"proxyMInWorld", has_proxy ? vectorJson(proxy) : OrderedJson()},
          {"lawForceNInWorld", vectorJson(law_force)},
          {"blendedForceNInWorld", vectorJson(blended_force)},
          {"dampedForceNInWorld", vectorJson(damped_force)},
          {"scaledForceNInWorld", vectorJson(scaled_force)},
          {"passiveForceNInWorld", vectorJson(passive_force)},
          {"filteredForceNInWorld", vectorJson(filtered_force)},
          {"slewedForceNInWorld", vectorJson(slewed_force)},
          {"commandForceNInWorld", vectorJson(command_force)},
          {"fixtureGeneration", fixture_generation},
          {"fixtureDistanceM", finiteOrNull(fixture_distance)},
          {"fixtureProxyMInWorld", vectorJson(fixture_proxy)},
          {"fixtureForceNInWorld", vectorJson(fixture_force)},
          {"guidanceForceNInWorld", vectorJson(guidance_force)},
          {"tissueGeneration", tissue_generation},
          {"cueForceNInWorld", vectorJson(cue_force)},
          {"stiffnessNPerM", stiffness},
          {"stiffnessBound", nameOf(stiffness_bound)},
          {"surfaceNoiseM", surface_noise > 0 ? OrderedJson(surface_noise) : OrderedJson()}};
}

OrderedJson deviceLatencyJson(const rt::LatencyProbe::Result& result) {
  const auto& [number, conclusive, latency_s, explained, mass_kg] = result;
  if (number == 0) return {};
  return {{"measurements", number},
          {"conclusive", conclusive},
          {"latencyS", conclusive ? OrderedJson(latency_s) : OrderedJson()},
          {"massKg", conclusive ? OrderedJson(mass_kg) : OrderedJson()},
          {"explained", explained}};
}

OrderedJson statusJson(const BoxStatus& status) {
  const auto& [loop_state, privileges, warnings, rate_hz, wakeup_latency, compute_time, trace_ticks_dropped,
               force_thread_page_faults, camera, scene, handle, uptime_s, law, leds, trace, control, fixtures,
               tissue, pending_reload] = status;
  const auto& [tick, counters, directive_generation, transition_count, transitions, transitions_by_cause,
               stiffness_rules, latency, fixture_states] = loop_state;

  OrderedJson loop = {{"rateHz", rate_hz}};
  loop.update(privilegesJson(privileges));
  loop.update(
      {{"directiveGeneration", directive_generation},
       {"wakeupLatency", latencyJson(wakeup_latency)},
       {"computeTime", latencyJson(compute_time)},
       {"counters", countersJson(counters)},
       {"transitions", transitionsJson(loop_state)},
       {"traceTicksDropped", trace_ticks_dropped},
       {"pageFaults", force_thread_page_faults ? OrderedJson(*force_thread_page_faults) : OrderedJson()}});
  return {{"mode", nameOf(tick.mode)},
          {"cause", nameOf(tick.cause)},
          {"warnings", OrderedJson(warnings)},
          {"version", kProductVersion},
          {"kernel", kernelRelease()},
          {"uptimeS", uptime_s},
          {"loop", std::move(loop)},
          {"tick", tickJson(tick)},
          {"stiffness", stiffnessJson(stiffness_rules)},
          {"deviceLatency", deviceLatencyJson(latency)},
          {"camera", cameraJson(camera)},
          {"scene", sceneJson(scene)},
          {"handle", handleJson(handle)},
          {"law", lawJson(law)},
          {"leds", ledsJson(leds)},
          {"trace", traceJson(trace)},
          {"control", controlJson(control)},
          {"fixtures", fixturesJson(fixtures)},
          {"tissue", tissueJson(tissue)},
          {"pendingReload", pendingReloadJson(pending_reload)}};
}

OrderedJson pendingReloadJson(const std::optional<PendingReload>& pending) {
  if (!pending) return {};
  const auto& [number, loosenings] = *pending;
  OrderedJson held = OrderedJson::array();
  for (const auto& [name, text] : loosenings) held.push_back({{"name", name}, {"text", text}});
  return {{"number", number}, {"held", held}};
}

OrderedJson windowJson(const TickWindow& window) {
  const auto& [ticks, contact_ticks, min_force_n, max_force_n, max_wakeup_latency_ns] = window.summary();
  const bool any = ticks != 0;
  return {{"ticks", ticks},
          {"contactTicks", contact_ticks},
          {"minForceN", any ? OrderedJson(min_force_n) : OrderedJson()},
          {"maxForceN", any ? OrderedJson(max_force_n) : OrderedJson()},
          {"maxWakeupLatencyNs", any ? OrderedJson(max_wakeup_latency_ns) : OrderedJson()},
          {"wakeupLatency", any ? latencyJson(window.wakeupLatency()) : OrderedJson()},
          {"computeTime", any ? latencyJson(window.computeTime()) : OrderedJson()}};
}

}  // namespace hapticd::daemon
