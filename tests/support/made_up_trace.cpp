// SPDX-License-Identifier: Apache-2.0
#include "tests/support/made_up_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "daemon/trace/format/cdr.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/mcap_writer.h"
#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/reader/trace_reader.h"

namespace hapticd::test {
namespace {

using Random = std::mt19937_64;

constexpr std::int64_t kTickPeriod_ns = 1'000'000;

/// Converts to any integer or truth value.
struct Any {
  Random& random;
  operator std::uint64_t() const { return random(); }
  operator std::int64_t() const { return static_cast<std::int64_t>(random()); }
  operator std::int32_t() const { return static_cast<std::int32_t>(random()); }
  operator std::uint32_t() const { return static_cast<std::uint32_t>(random()); }
  operator bool() const { return (random() & 1) != 0; }
};

/// Returns the time of a record; two of them are less than the longest chunk apart.
std::int64_t anyTime_ns(Random& random) {
  return static_cast<std::int64_t>(random() >> 2);
}

double anyDouble(Random& random) {
  const std::uint64_t bits = random();
  const auto value = std::bit_cast<double>(bits);
  if (bits % 16 == 0) return std::numeric_limits<double>::infinity();
  if (bits % 16 == 1) return -0.0;
  if (bits % 16 == 2) return std::numeric_limits<double>::denorm_min();
  return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
}

rt::Vec3 anyVector(Random& random) {
  const double x = anyDouble(random), y = anyDouble(random), z = anyDouble(random);
  return {x, y, z};
}

template <typename Enumeration>
Enumeration anyOf(Random& random, unsigned count) {
  return static_cast<Enumeration>(random() % count);
}

std::string anyText(Random& random) {
  std::string text = "ä \"quoted\", 'more'\n\t";
  for (std::size_t i = random() % 20; i > 0; --i) text.push_back(static_cast<char>('!' + random() % 90));
  return text;
}

std::vector<std::pair<std::string, std::string>> anyPairs(Random& random) {
  std::vector<std::pair<std::string, std::string>> pairs{{"", ""}};
  for (std::size_t i = random() % 5; i > 0; --i) {
    std::string name = "name." + std::to_string(i);
    pairs.emplace_back(std::move(name), anyText(random));
  }
  return pairs;
}

rt::HandleState anyHandle(Random& random) {
  rt::HandleState handle;
  handle.position_m_in_world = anyVector(random);
  handle.velocity_m_per_s_in_world = anyVector(random);
  handle.sequence = Any{random};
  handle.time_ns = Any{random};
  handle.session = Any{random};
  handle.condition = anyOf<rt::HandleCondition>(random, 3);
  handle.buttons = Any{random};
  handle.delay_s = anyDouble(random);
  handle.command_latency_ns = Any{random};
  handle.damps = Any{random};
  handle.velocity_claim = anyOf<rt::VelocityClaim>(random, 4);
  handle.probes = Any{random};
  handle.has_orientation = Any{random};
  handle.has_gripper = Any{random};
  handle.orientation_in_world = {anyDouble(random), anyDouble(random), anyDouble(random), anyDouble(random)};
  handle.gripper_rad = anyDouble(random);
  return handle;
}

void setFlags(rt::Tick& tick, const Any& any) {
  tick.slew_limited = any;
  tick.magnitude_clamped = any;
  tick.not_finite = any;
  tick.released = any;
  tick.passivity_acted = any;
  tick.thermally_limited = any;
  tick.outside_model = any;
  tick.stopping = any;
  tick.after_overrun = any;
  tick.blending = any;
}

void setForces(rt::Tick& tick, Random& random) {
  tick.law_force_n_in_world = anyVector(random);
  tick.blended_force_n_in_world = anyVector(random);
  tick.damped_force_n_in_world = anyVector(random);
  tick.scaled_force_n_in_world = anyVector(random);
  tick.passive_force_n_in_world = anyVector(random);
  tick.filtered_force_n_in_world = anyVector(random);
  tick.slewed_force_n_in_world = anyVector(random);
  tick.command_force_n_in_world = anyVector(random);
}

void setAdditions(rt::Tick& tick, Random& random) {
  const Any any{random};
  tick.fixture_generation = any;
  tick.fixtures_in_contact = any;
  tick.nearest_fixture = any;
  tick.fixture_distance_m = anyDouble(random);
  tick.fixture_proxy_m_in_world = anyVector(random);
  tick.fixture_force_n_in_world = anyVector(random);
  tick.guidance_force_n_in_world = anyVector(random);
  tick.tissue_generation = any;
  tick.tissue_region = any;
  tick.cue_force_n_in_world = anyVector(random);
  tick.external_force_n_in_world = anyVector(random);
  tick.stiffness_n_per_m = anyDouble(random);
  tick.stiffness_bound = anyOf<rt::StiffnessBound>(random, 6);
  tick.surface_noise_m = anyDouble(random);
  tick.hidden_latency_s = anyDouble(random);
  tick.depth_share = anyDouble(random);
  tick.frame_pose = any;
}

void check(const auto& done) {
  if (!done) throw std::runtime_error(done.error().text());
}

}  // namespace

rt::Tick madeUpTick(Random& random, std::uint64_t number) {
  const Any any{random};
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = static_cast<std::int64_t>(number) * kTickPeriod_ns;
  tick.wakeup_latency_ns = any;
  tick.compute_ns = any;
  tick.directive_generation = any;
  tick.trace_dropped = any;
  tick.mode = anyOf<rt::Mode>(random, rt::kModeCount);
  tick.cause = anyOf<rt::Cause>(random, rt::kCauseCount);
  setFlags(tick, any);
  tick.law = anyOf<rt::ForceLaw>(random, 4);
  tick.contact = anyOf<rt::ContactState>(random, 3);
  tick.points_used = any;
  tick.scene_frame = any;
  tick.scene_model = any;
  tick.scene_age_ns = any;
  tick.handle = anyHandle(random);
  tick.hip_m_in_world = anyVector(random);
  tick.proxy_m_in_world = anyVector(random);
  tick.gain = anyDouble(random);
  tick.energy_j = anyDouble(random);
  tick.stiffness_limit_n_per_m = anyDouble(random);
  tick.stiffness_gain = anyDouble(random);
  tick.stiffness_rule = anyOf<rt::StiffnessRule>(random, 3);
  tick.contact_damping_n_s_per_m = anyDouble(random);
  setForces(tick, random);
  setAdditions(tick, random);
  return tick;
}

trace::ModelRecord madeUpModel(Random& random) {
  const Any any{random};
  trace::ModelRecord model;
  model.model = any;
  model.time_ns = anyTime_ns(random);
  model.build_ns = any;
  model.frame = any;
  model.frame_time_ns = any;
  model.device_ticks = any;
  model.centre_m_in_world = anyVector(random);
  model.radius_m = anyDouble(random);
  model.generation = any;
  model.forgot = any;
  model.depth_recorded = any;
  model.points = any;
  model.points_over_capacity = any;
  model.frames = any;
  model.skipped_frames = any;
  model.damaged_frames = any;
  return model;
}

trace::DirectiveRecord madeUpDirective(Random& random) {
  const Any any{random};
  trace::DirectiveRecord directive;
  directive.time_ns = anyTime_ns(random);
  directive.generation = any;
  directive.engage = any;
  directive.engage_inside = any;
  directive.engage_request = any;
  directive.standoff_clearance_m = anyDouble(random);
  directive.parameters = anyPairs(random);
  return directive;
}

trace::AdditionsRecord madeUpAdditions(Random& random) {
  const Any any{random};
  trace::AdditionsRecord additions;
  additions.time_ns = anyTime_ns(random);
  additions.fixture_generation = any;
  additions.tissue_generation = any;
  additions.tool_radius_m = 1e-3 * static_cast<double>(random() % 20);
  additions.text = anyText(random);
  for (std::size_t i = random() % 40; i > 0; --i) {
    additions.labels.bytes.push_back(static_cast<char>(random()));
  }
  additions.fixtures = anyPairs(random);
  additions.regions = anyPairs(random);
  return additions;
}

trace::PoseRecord madeUpPose(Random& random) {
  const Any any{random};
  trace::PoseRecord pose;
  pose.time_ns = anyTime_ns(random);
  pose.number = any;
  pose.frame = any;
  pose.pose_time_ns = any;
  pose.position_m_in_world = {anyDouble(random), anyDouble(random), anyDouble(random)};
  pose.orientation_x = anyDouble(random);
  pose.orientation_y = anyDouble(random);
  pose.orientation_z = anyDouble(random);
  pose.orientation_w = anyDouble(random);
  pose.has_velocity = any;
  pose.velocity_m_per_s_in_world = {anyDouble(random), anyDouble(random), anyDouble(random)};
  return pose;
}

trace::EventRecord madeUpEvent(Random& random) {
  trace::EventRecord event;
  event.time_ns = anyTime_ns(random);
  event.kind = "kind";
  event.text = anyText(random);
  event.fields = anyPairs(random);
  return event;
}

trace::SnapshotRecord madeUpSnapshot(Random& random) {
  trace::SnapshotRecord record;
  record.time_ns = anyTime_ns(random);
  record.snapshot.request = Any{random};
  record.snapshot.tick = Any{random};
  std::string bytes;
  while (bytes.size() < sizeof record.snapshot.memory) bytes.push_back(static_cast<char>(random()));
  std::memcpy(&record.snapshot.memory, bytes.data(), bytes.size());
  return record;
}

trace::DepthRecord madeUpDepth(Random& random) {
  const Any any{random};
  rt::DepthFrameHeader header;
  header.width_px = 1 + static_cast<std::uint32_t>(random() % 40);
  header.height_px = 1 + static_cast<std::uint32_t>(random() % 20);
  header.stride_bytes = 2 * header.width_px;
  header.depth_law = anyOf<rt::DepthLawKind>(random, 2);
  header.noise = anyOf<rt::DepthNoiseKind>(random, 2);
  header.raw_no_measurement = random() % 2 == 0 ? 0 : 2047;
  header.device_ticks = any;
  for (double& number : header.depth_law_coefficients) number = anyDouble(random);
  for (double* const number : {&header.fx_px, &header.fy_px, &header.cx_px, &header.cy_px}) {
    *number = anyDouble(random);
  }
  for (double& number : header.rotation_world_camera) number = anyDouble(random);
  for (double& number : header.position_m_in_world) number = anyDouble(random);
  for (double& number : header.noise_coefficients) number = anyDouble(random);
  header.exposure_ns = any;
  header.arrival_ns = anyTime_ns(random);
  header.frame = any;
  header.device_tick_hz = any;
  header.serial = {'A', '0', '0', '3', '6', '2'};
  std::vector<std::uint16_t> image(std::size_t{header.width_px} * header.height_px);
  std::uint16_t raw = 900;
  for (std::uint16_t& pixel : image) {
    raw = static_cast<std::uint16_t>(raw + random() % 5 - 2);
    pixel = random() % 8 == 0 ? static_cast<std::uint16_t>(header.raw_no_measurement) : raw;
    if (random() % 16 == 0) pixel = static_cast<std::uint16_t>(random());
  }
  trace::DepthRecord record;
  trace::DepthEncoder().encode(header, std::as_bytes(std::span(image)), record);
  return record;
}

MadeUpRecords madeUpRecords(std::size_t chunks, std::size_t ticks_per_chunk, unsigned seed) {
  Random random(seed);
  MadeUpRecords records;
  for (std::size_t i = 1; i <= chunks * ticks_per_chunk; ++i) records.ticks.push_back(madeUpTick(random, i));
  // a later time would be the log time of all messages that follow
  const auto first_chunk_ns = static_cast<std::int64_t>(ticks_per_chunk) * kTickPeriod_ns;
  const auto add = [&](auto& several, auto record) {
    record.time_ns = anyTime_ns(random) % first_chunk_ns;
    several.push_back(std::move(record));
  };
  for (int i = 0; i < 3; ++i) {
    add(records.models, madeUpModel(random));
    add(records.directives, madeUpDirective(random));
    add(records.additions, madeUpAdditions(random));
    add(records.poses, madeUpPose(random));
    add(records.events, madeUpEvent(random));
    add(records.snapshots, madeUpSnapshot(random));
  }
  const auto sort = [](auto& several) {
    std::ranges::stable_sort(several, {}, [](const auto& record) { return trace::timeOf(record); });
  };
  std::apply([&](auto&... kinds) { (sort(kinds), ...); }, records.others());
  return records;
}

void writeTrace(const std::filesystem::path& file, const MadeUpRecords& records, std::size_t ticks_per_chunk,
                const trace::TraceOptions& options) {
  trace::TraceOptions ours = options;
  ours.chunk_ns = std::numeric_limits<std::int64_t>::max();  // chunks end at flush()
  ours.depth = ours.depth || !records.depth.empty();
  auto writer = trace::TraceWriter::create(file, ours);
  if (!writer) throw std::runtime_error(writer.error().text());
  const auto writeAll = [&writer](const auto& several) {
    for (const auto& record : several) check((*writer)->write(record));
  };
  std::apply([&](const auto&... kinds) { (writeAll(kinds), ...); }, records.others());
  for (std::size_t i = 0; i < records.ticks.size(); ++i) {
    if (i > 0 && i % ticks_per_chunk == 0) check((*writer)->flush());
    check((*writer)->write(records.ticks[i]));
  }
  check((*writer)->close());
}

MadeUpRecords recordsIn(const std::filesystem::path& file) {
  MadeUpRecords records;
  const auto into = [](auto& several) {
    return [&several](const auto& record) { return several.push_back(record), true; };
  };
  const auto info = trace::readTrace(file, {.tick = into(records.ticks),
                                            .model = into(records.models),
                                            .directive = into(records.directives),
                                            .additions = into(records.additions),
                                            .pose = into(records.poses),
                                            .event = into(records.events),
                                            .snapshot = into(records.snapshots),
                                            .depth = into(records.depth)});
  check(info);
  if (!info->complete) throw std::runtime_error(file.string() + " is not complete");
  return records;
}

namespace {

template <typename Record>
std::string difference(const std::vector<Record>& one, const std::vector<Record>& other) {
  const std::string_view topic = trace::kChannelName<Record>.topic;
  if (one.size() != other.size())
    return fmt::format("{}: {} and {} records", topic, one.size(), other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    const auto bits = bitsOf(one[i]), bits_of_other = bitsOf(other[i]);
    const auto [field, field_of_other] = std::ranges::mismatch(bits, bits_of_other);
    if (field != bits.end()) return fmt::format("{}: {} of record {}", topic, field->first, i);
  }
  return "";
}

}  // namespace

std::string differenceOf(const MadeUpRecords& one, const MadeUpRecords& other) {
  std::string found = difference(one.ticks, other.ticks);
  const auto first = [&]<std::size_t... kKind>(std::index_sequence<kKind...>) {
    ((found =
          found.empty() ? difference(std::get<kKind>(one.others()), std::get<kKind>(other.others())) : found),
     ...);
  };
  first(std::make_index_sequence<std::tuple_size_v<decltype(one.others())>>());
  return found;
}

void writeOlderTrace(const std::filesystem::path& file, const std::vector<rt::Tick>& ticks,
                     std::string_view without) {
  constexpr std::size_t kForceBytes = 3 * sizeof(double);
  const std::string line = fmt::format("float64[3] {}\n", without);
  std::string schema = trace::schemaOf<rt::Tick>();
  const auto layout = trace::MessageLayout::of(schema);
  const auto field = layout ? layout->find(without) : std::nullopt;
  if (!field || schema.find(line) == std::string::npos) throw std::invalid_argument(line);
  schema.erase(schema.find(line), line.size());

  auto part = trace::TraceFile::create(trace::partOf(file));
  check(part);
  trace::mcap::Writer writer(std::move(*part), file, true);
  using Pairs = std::vector<std::pair<std::string, std::string>>;
  writer.addMetadata(trace::kTraceMetadata,
                     Pairs{{std::string(trace::kVersionKey), std::string(trace::kTraceVersion)},
                           {std::string(trace::kOffsetKey), "0"}});
  writer.addMetadata(trace::kOwnerMetadata, Pairs{{std::string(trace::kWriterVersionKey), "0.0.7"}});
  const auto& [topic, schema_name] = trace::kChannelName<rt::Tick>;
  const std::uint16_t channel = writer.addChannel(topic, schema_name, schema);
  check(writer.begin());
  std::uint32_t sequence = 0;
  for (const rt::Tick& tick : ticks) {
    const auto time_ns = static_cast<std::uint64_t>(tick.planned_ns);
    std::string message;
    trace::encode(tick, time_ns, message);
    std::vector<std::size_t> places;
    if (!layout->locate(message, places)) throw std::logic_error("a message without all fields");
    message.erase(trace::kCdrHead.size() + places[*field], kForceBytes);
    writer.addMessage(channel, ++sequence, time_ns, message);
  }
  check(writer.finish());
}

}  // namespace hapticd::test
