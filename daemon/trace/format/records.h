// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/solids/solid_file.h"
#include "rt/base/fields.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame_header.h"
#include "rt/loop/force_loop.h"
#include "rt/loop/loop_state.h"

/// The records of a trace, one structure per channel; ticks are rt::Tick. Times are CLOCK_MONOTONIC in
/// nanoseconds; a trace contains the offset of its clock to CLOCK_REALTIME.
namespace hapticd::trace {

/// Bytes of variable length.
struct ByteString {
  std::string bytes = {};
};

/// A scene built by the scene thread, and the frame that it was built from.
struct ModelRecord {
  std::uint64_t model = 0;          ///< number of the scene, see Tick::scene_model
  std::int64_t time_ns = 0;         ///< when it was built
  std::int64_t build_ns = 0;        ///< duration of building it
  std::uint64_t frame = 0;          ///< sequence number of the depth frame
  std::int64_t frame_time_ns = 0;   ///< arrival of the frame
  std::uint32_t device_ticks = 0;   ///< the camera's own counter
  rt::Vec3 centre_m_in_world = {};  ///< centre of the modelled region
  double radius_m = 0;              ///< requested radius
  std::uint64_t generation = 0;     ///< of the Directive whose needs it meets
  bool forgot = false;              ///< filter and fusion were restarted with it
  bool depth_recorded = false;      ///< the raw frame was added to the trace
  std::uint32_t points = 0;
  std::uint32_t points_over_capacity = 0;
  std::uint64_t frames = 0;          ///< received so far
  std::uint64_t skipped_frames = 0;  ///< so far: replaced by a newer one before they were modelled
  std::uint64_t damaged_frames = 0;  ///< so far: discarded by the camera driver
};

/// The directive that the force loop follows from this generation on.
struct DirectiveRecord {
  std::int64_t time_ns = 0;
  std::uint64_t generation = 0;
  bool engage = false;
  bool engage_inside = false;
  std::uint64_t engage_request = 0;
  double standoff_clearance_m = 0;  ///< see rt::LiveParameters; it follows from the fixtures
  /// All live parameters by name, in a form that reads back as the same value. They name the law in use even
  /// if force.law is auto.
  std::vector<std::pair<std::string, std::string>> parameters = {};
};

/// Solids that become attachments of a trace, once each (attachmentNameOf()), and are no field of a message.
using AttachedSolids = std::vector<std::shared_ptr<const config::Solid>>;

/// The virtual fixtures and tissue regions in effect from this pair of generations on. What the force loop
/// remembers of them refers to the numbers that it knows them by, so these are recorded too.
struct AdditionsRecord {
  std::int64_t time_ns = 0;
  std::uint64_t fixture_generation = 0;  ///< see Tick::fixture_generation
  std::uint64_t tissue_generation = 0;   ///< see Tick::tissue_generation
  double tool_radius_m = 0;              ///< by which forbidden regions are larger
  std::string text = {};                 ///< the lists `fixtures` and `regions` as YAML
  ByteString labels = {};  ///< label of each pixel of the depth image, row by row; empty: no label image
  std::uint32_t label_width_px = 0;  ///< size of the label image; 0: there is none
  std::uint32_t label_height_px = 0;
  /// Name of each fixture, and its rt::Fixture::identity and rt::Fixture::definition with a blank between.
  std::vector<std::pair<std::string, std::string>> fixtures = {};
  /// Name of each region, and its rt::TissueRegion::identity.
  std::vector<std::pair<std::string, std::string>> regions = {};
  AttachedSolids solids = {};  ///< those that the text refers to
};

/// One pose of a moving frame, as it was handed to the force loop; whether that used it is in its counters.
struct PoseRecord {
  std::int64_t time_ns = 0;       ///< when it was handed over
  std::uint64_t number = 0;       ///< see Tick::frame_pose
  std::uint32_t frame = 0;        ///< rt::FrameRules::identity, which follows from the name
  std::int64_t pose_time_ns = 0;  ///< when the frame was there
  rt::Vec3 position_m_in_world = {};
  double orientation_x = 0;  ///< of a quaternion
  double orientation_y = 0;
  double orientation_z = 0;
  double orientation_w = 1;
  bool has_velocity = false;
  rt::Vec3 velocity_m_per_s_in_world = {};
};

/// An event, as in the journal.
struct EventRecord {
  std::int64_t time_ns = 0;
  std::string kind = {};  ///< mode, camera, handle, parameter, engage, warning, trace, ...
  std::string text = {};  ///< one line for people
  std::vector<std::pair<std::string, std::string>> fields = {};
};

/// Snapshot of the core's memory before a tick; valid only for the same version of hapticd.
struct SnapshotRecord {
  std::int64_t time_ns = 0;
  rt::CoreSnapshot snapshot = {};
  /// False if the trace was written by a version with another layout of the core; its memory is then empty.
  bool usable = true;
};

/// Encoding of the raw values in DepthRecord::image (depth_codec.h).
enum class DepthEncoding : std::uint8_t {
  plain,       ///< uncompressed
  above_zstd,  ///< differences to the value above, compressed with zstd
};
constexpr auto wordsOf(DepthEncoding) {
  return rt::words<DepthEncoding>("plain", "above_zstd");
}

/// A raw depth frame.
struct DepthRecord {
  rt::DepthFrameHeader header = {};
  std::uint32_t raw_crc32 = 0;  ///< IEEE 802.3, of the stride_bytes * height_px bytes of raw values
  DepthEncoding encoding = DepthEncoding::plain;
  ByteString image = {};
};

/// The points of a depth frame that the hand can reach, for viewers; nothing reads them back.
struct CloudRecord {
  std::int64_t time_ns = 0;                     ///< arrival of the frame
  std::vector<float> points_m_in_optical = {};  ///< x, y, z, x, y, z, ... in the optical frame of the camera
};

/// A file stored in a trace.
struct TraceAttachment {
  std::string name;
  std::string media_type;
  std::string data;
};

// The fields of each record, for messages, schemas and exports: visitFields(record, visit) calls
// visit(name, member) in the order of the message. Those of a tick are in its own table
// (rt/loop/loop_state.h).

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
