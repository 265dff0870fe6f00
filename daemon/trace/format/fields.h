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
  return std::tuple{HAPTICD_MEMBER(model),
                    HAPTICD_MEMBER(time_ns),
                    HAPTICD_MEMBER(build_ns),
                    HAPTICD_MEMBER(frame),
                    HAPTICD_MEMBER(frame_time_ns),
                    HAPTICD_MEMBER(device_ticks),
                    HAPTICD_MEMBER(centre_m_in_world),
                    HAPTICD_MEMBER(radius_m),
                    HAPTICD_MEMBER(generation),
                    HAPTICD_MEMBER(forgot),
                    HAPTICD_MEMBER(depth_recorded),
                    HAPTICD_MEMBER(points),
                    HAPTICD_MEMBER(points_over_capacity),
                    HAPTICD_MEMBER(frames),
                    HAPTICD_MEMBER(skipped_frames),
                    HAPTICD_MEMBER(damaged_frames)};
}

template <std::same_as<DirectiveRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_MEMBER(time_ns),        HAPTICD_MEMBER(generation),
                    HAPTICD_MEMBER(engage),         HAPTICD_MEMBER(engage_inside),
                    HAPTICD_MEMBER(engage_request), HAPTICD_MEMBER(standoff_clearance_m),
                    HAPTICD_MEMBER(parameters)};
}

template <std::same_as<AdditionsRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_MEMBER(time_ns),
                    HAPTICD_MEMBER(fixture_generation),
                    HAPTICD_MEMBER(tissue_generation),
                    HAPTICD_MEMBER(text),
                    HAPTICD_MEMBER(labels),
                    HAPTICD_MEMBER(label_width_px),
                    HAPTICD_MEMBER(label_height_px),
                    HAPTICD_MEMBER(fixtures),
                    HAPTICD_MEMBER(regions)};
}

template <std::same_as<EventRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_MEMBER(time_ns), HAPTICD_MEMBER(kind), HAPTICD_MEMBER(text),
                    HAPTICD_MEMBER(fields)};
}

template <std::same_as<DepthRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_MEMBER(header), HAPTICD_MEMBER(raw_crc32), HAPTICD_MEMBER(encoding),
                    HAPTICD_MEMBER(image)};
}

template <std::same_as<SnapshotRecord> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{HAPTICD_MEMBER(time_ns), HAPTICD_MEMBER(snapshot.request).tracedAs("request"),
                    HAPTICD_MEMBER(snapshot.tick).tracedAs("tick"),
                    HAPTICD_MEMBER(snapshot.memory).tracedAs("memory"), HAPTICD_MEMBER(usable).tracedAs("")};
}

/// The fields of a member that has rows of its own stand in its place.
template <typename Record>
void visitFields(Record& record, auto&& visit) {
  rt::forEachField<std::remove_const_t<Record>>([&](const auto& field) {
    auto& member = field.get(record);
    if constexpr (rt::Tabled<std::remove_cvref_t<decltype(member)>>) {
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
