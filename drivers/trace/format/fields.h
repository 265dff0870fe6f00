// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <type_traits>

#include "drivers/trace/format/records.h"

/// Lists the fields of each record once, for messages, schemas and exports. visitFields(record, visit) calls
/// visit(name, field) in the order of the message. Names end in their units. A structure that gains a member
/// does not compile here until the member is named.
namespace hapticd::drivers {

template <typename Type, typename Record>
concept MaybeConst = std::same_as<std::remove_const_t<Type>, Record>;

template <MaybeConst<rt::HandleState> Handle>
void visitHandleFields(Handle& handle, auto& visit) {
  auto& [position, velocity, sequence, time_ns, session, condition, buttons, delay_s, command_latency_ns,
         damps, velocity_source, probes] = handle;
  visit("handle_position_m_in_world", position);
  visit("handle_velocity_m_per_s_in_world", velocity);
  visit("handle_sequence", sequence);
  visit("handle_time_ns", time_ns);
  visit("handle_session", session);
  visit("handle_condition", condition);
  visit("handle_buttons", buttons);
  visit("handle_delay_s", delay_s);
  visit("handle_command_latency_ns", command_latency_ns);
  visit("handle_damps", damps);
  visit("handle_velocity_source", velocity_source);
  visit("handle_probes", probes);
}

template <MaybeConst<rt::Tick> Tick>
void visitFields(Tick& tick, auto&& visit) {
  auto& [number, planned_ns, wakeup_latency_ns, compute_ns, directive_generation, trace_dropped, mode, cause,
         slew_limited, magnitude_clamped, not_finite, released, passivity_acted, thermally_limited,
         outside_model, stopping, after_overrun, blending, law, contact, points_used, scene_frame,
         scene_model, scene_age_ns, handle, hip, proxy, gain, energy_j, stiffness_limit, stiffness_gain,
         stiffness_rule, contact_damping, law_force, blended_force, damped_force, scaled_force, passive_force,
         filtered_force, slewed_force, command_force, fixture_generation, fixtures_in_contact,
         nearest_fixture, fixture_distance, fixture_proxy, fixture_force, guidance_force, tissue_generation,
         tissue_region, cue_force, stiffness, stiffness_bound, surface_noise, hidden_latency, depth_share] =
      tick;
  visit("number", number);
  visit("planned_ns", planned_ns);
  visit("wakeup_latency_ns", wakeup_latency_ns);
  visit("compute_ns", compute_ns);
  visit("directive_generation", directive_generation);
  visit("trace_dropped", trace_dropped);
  visit("mode", mode);
  visit("cause", cause);
  visit("slew_limited", slew_limited);
  visit("magnitude_clamped", magnitude_clamped);
  visit("not_finite", not_finite);
  visit("released", released);
  visit("passivity_acted", passivity_acted);
  visit("thermally_limited", thermally_limited);
  visit("outside_model", outside_model);
  visit("stopping", stopping);
  visit("after_overrun", after_overrun);
  visit("blending", blending);
  visit("law", law);
  visit("contact", contact);
  visit("points_used", points_used);
  visit("scene_frame", scene_frame);
  visit("scene_model", scene_model);
  visit("scene_age_ns", scene_age_ns);
  visitHandleFields(handle, visit);
  visit("hip_m_in_world", hip);
  visit("proxy_m_in_world", proxy);
  visit("gain", gain);
  visit("energy_j", energy_j);
  visit("stiffness_limit_n_per_m", stiffness_limit);
  visit("stiffness_gain", stiffness_gain);
  visit("stiffness_rule", stiffness_rule);
  visit("contact_damping_n_s_per_m", contact_damping);
  visit("law_force_n_in_world", law_force);
  visit("blended_force_n_in_world", blended_force);
  visit("damped_force_n_in_world", damped_force);
  visit("scaled_force_n_in_world", scaled_force);
  visit("passive_force_n_in_world", passive_force);
  visit("filtered_force_n_in_world", filtered_force);
  visit("slewed_force_n_in_world", slewed_force);
  visit("command_force_n_in_world", command_force);
  visit("fixture_generation", fixture_generation);
  visit("fixtures_in_contact", fixtures_in_contact);
  visit("nearest_fixture", nearest_fixture);
  visit("fixture_distance_m", fixture_distance);
  visit("fixture_proxy_m_in_world", fixture_proxy);
  visit("fixture_force_n_in_world", fixture_force);
  visit("guidance_force_n_in_world", guidance_force);
  visit("tissue_generation", tissue_generation);
  visit("tissue_region", tissue_region);
  visit("cue_force_n_in_world", cue_force);
  visit("stiffness_n_per_m", stiffness);
  visit("stiffness_bound", stiffness_bound);
  visit("surface_noise_m", surface_noise);
  visit("hidden_latency_s", hidden_latency);
  visit("depth_share", depth_share);
}

template <MaybeConst<ModelRecord> Model>
void visitFields(Model& model_record, auto&& visit) {
  auto& [model, time_ns, build_ns, frame, frame_time_ns, device_ticks, centre, radius_m, generation, forgot,
         depth_recorded, points, points_over_capacity, frames, skipped_frames, damaged_frames] = model_record;
  visit("model", model);
  visit("time_ns", time_ns);
  visit("build_ns", build_ns);
  visit("frame", frame);
  visit("frame_time_ns", frame_time_ns);
  visit("device_ticks", device_ticks);
  visit("centre_m_in_world", centre);
  visit("radius_m", radius_m);
  visit("generation", generation);
  visit("forgot", forgot);
  visit("depth_recorded", depth_recorded);
  visit("points", points);
  visit("points_over_capacity", points_over_capacity);
  visit("frames", frames);
  visit("skipped_frames", skipped_frames);
  visit("damaged_frames", damaged_frames);
}

template <MaybeConst<DirectiveRecord> Directive>
void visitFields(Directive& directive, auto&& visit) {
  auto& [time_ns, generation, engage, engage_inside, engage_request, standoff_clearance, parameters] =
      directive;
  visit("time_ns", time_ns);
  visit("generation", generation);
  visit("engage", engage);
  visit("engage_inside", engage_inside);
  visit("engage_request", engage_request);
  visit("standoff_clearance_m", standoff_clearance);
  visit("parameters", parameters);
}

template <MaybeConst<AdditionsRecord> Additions>
void visitFields(Additions& additions, auto&& visit) {
  auto& [time_ns, fixture_generation, tissue_generation, text, labels, label_width, label_height, fixtures,
         regions] = additions;
  visit("time_ns", time_ns);
  visit("fixture_generation", fixture_generation);
  visit("tissue_generation", tissue_generation);
  visit("text", text);
  visit("labels", labels);
  visit("label_width_px", label_width);
  visit("label_height_px", label_height);
  visit("fixtures", fixtures);
  visit("regions", regions);
}

template <MaybeConst<EventRecord> Event>
void visitFields(Event& event, auto&& visit) {
  auto& [time_ns, kind, text, fields] = event;
  visit("time_ns", time_ns);
  visit("kind", kind);
  visit("text", text);
  visit("fields", fields);
}

template <MaybeConst<SnapshotRecord> Record>
void visitFields(Record& record, auto&& visit) {
  auto& [time_ns, snapshot, usable] = record;
  auto& [request, tick, memory] = snapshot;
  visit("time_ns", time_ns);
  visit("request", request);
  visit("tick", tick);
  visit("memory", memory);
}

/// In the order of the structure, because a message contains the bytes of its fields.
template <MaybeConst<rt::DepthFrameHeader> Header>
void visitHeaderFields(Header& header, auto& visit) {
  auto& [magic, version, header_bytes, width_px, height_px, stride_bytes, raw_type, depth_law, noise,
         principle, raw_no_measurement, device_ticks, depth_law_coefficients, fx_px, fy_px, cx_px, cy_px,
         rotation_world_camera, position_m_in_world, noise_coefficients, exposure_ns, arrival_ns, frame,
         device_tick_hz, serial, standing_share, correlation_px] = header;
  visit("magic", magic);
  visit("header_version", version);
  visit("header_bytes", header_bytes);
  visit("width_px", width_px);
  visit("height_px", height_px);
  visit("stride_bytes", stride_bytes);
  visit("raw_type", raw_type);
  visit("depth_law", depth_law);
  visit("noise", noise);
  visit("principle", principle);
  visit("raw_no_measurement", raw_no_measurement);
  visit("device_ticks", device_ticks);
  visit("depth_law_coefficients", depth_law_coefficients);
  visit("fx_px", fx_px);
  visit("fy_px", fy_px);
  visit("cx_px", cx_px);
  visit("cy_px", cy_px);
  visit("rotation_world_camera", rotation_world_camera);
  visit("position_m_in_world", position_m_in_world);
  visit("noise_coefficients", noise_coefficients);
  visit("exposure_ns", exposure_ns);
  visit("arrival_ns", arrival_ns);
  visit("frame", frame);
  visit("device_tick_hz", device_tick_hz);
  visit("serial", serial);
  visit("standing_share", standing_share);
  visit("correlation_px", correlation_px);
}

template <MaybeConst<DepthRecord> Record>
void visitFields(Record& record, auto&& visit) {
  auto& [header, raw_crc32, encoding, image] = record;
  visitHeaderFields(header, visit);
  visit("raw_crc32", raw_crc32);
  visit("encoding", encoding);
  visit("image", image);
}

/// Returns CLOCK_MONOTONIC of a record.
inline std::int64_t timeOf(const DepthRecord& depth) {
  return depth.header.arrival_ns;
}
inline std::int64_t timeOf(const rt::Tick& tick) {
  return tick.planned_ns;
}
inline std::int64_t timeOf(const auto& record) {
  return record.time_ns;
}

}  // namespace hapticd::drivers
