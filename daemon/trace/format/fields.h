// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "daemon/trace/format/records.h"
#include "rt/base/fields.h"

/// The fields of each record, for messages, schemas and exports: visitFields(record, visit) calls
/// visit(name, member) in the order of the message. Those of a tick are in its own table
/// (rt/loop/loop_state.h).
namespace hapticd::trace {

template <std::same_as<ModelRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(model),
                    HAPTICD_TRACED(time_ns),
                    HAPTICD_TRACED(build_ns),
                    HAPTICD_TRACED(frame),
                    HAPTICD_TRACED(frame_time_ns),
                    HAPTICD_TRACED(device_ticks),
                    HAPTICD_TRACED(centre_m_in_world),
                    HAPTICD_TRACED(radius_m),
                    HAPTICD_TRACED(generation),
                    HAPTICD_TRACED(forgot),
                    HAPTICD_TRACED(depth_recorded),
                    HAPTICD_TRACED(points),
                    HAPTICD_TRACED(points_over_capacity),
                    HAPTICD_TRACED(frames),
                    HAPTICD_TRACED(skipped_frames),
                    HAPTICD_TRACED(damaged_frames)};
}

template <std::same_as<DirectiveRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(time_ns),        HAPTICD_TRACED(generation),
                    HAPTICD_TRACED(engage),         HAPTICD_TRACED(engage_inside),
                    HAPTICD_TRACED(engage_request), HAPTICD_TRACED(standoff_clearance_m),
                    HAPTICD_TRACED(parameters)};
}

template <std::same_as<AdditionsRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(time_ns),
                    HAPTICD_TRACED(fixture_generation),
                    HAPTICD_TRACED(tissue_generation),
                    HAPTICD_TRACED(tool_radius_m),
                    HAPTICD_TRACED(text),
                    HAPTICD_TRACED(labels),
                    HAPTICD_TRACED(label_width_px),
                    HAPTICD_TRACED(label_height_px),
                    HAPTICD_TRACED(fixtures),
                    HAPTICD_TRACED(regions),
                    HAPTICD_TRACED(solids).tracedAs("")};
}

template <std::same_as<PoseRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(time_ns),
                    HAPTICD_TRACED(number),
                    HAPTICD_TRACED(frame),
                    HAPTICD_TRACED(pose_time_ns),
                    HAPTICD_TRACED(position_m_in_world),
                    HAPTICD_TRACED(orientation_x),
                    HAPTICD_TRACED(orientation_y),
                    HAPTICD_TRACED(orientation_z),
                    HAPTICD_TRACED(orientation_w),
                    HAPTICD_TRACED(has_velocity),
                    HAPTICD_TRACED(velocity_m_per_s_in_world)};
}

template <std::same_as<EventRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(time_ns), HAPTICD_TRACED(kind), HAPTICD_TRACED(text),
                    HAPTICD_TRACED(fields)};
}

template <std::same_as<DepthRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(header), HAPTICD_TRACED(raw_crc32), HAPTICD_TRACED(encoding),
                    HAPTICD_TRACED(image)};
}

template <std::same_as<SnapshotRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_TRACED(time_ns), HAPTICD_TRACED(snapshot.request).tracedAs("request"),
                    HAPTICD_TRACED(snapshot.tick).tracedAs("tick"),
                    HAPTICD_TRACED(snapshot.memory).tracedAs("memory"), HAPTICD_TRACED(usable).tracedAs("")};
}

/// The fields of a member that has rows of its own stand in its place.
template <typename Record>
void visitFields(Record& record, auto&& visit) {
  rt::forEachField<std::remove_const_t<Record>>([&](const auto& field) {
    auto& member = field.get(record);
    using Member = std::remove_cvref_t<decltype(member)>;
    if constexpr (std::same_as<Member, AttachedSolids>) {
      return;
    } else if constexpr (rt::Tabled<Member>) {
      visitFields(member, visit);
    } else if (!field.trace_name.text().empty()) {
      visit(field.trace_name.text(), member);
    }
  });
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
}  // namespace hapticd::trace
