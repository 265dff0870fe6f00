// SPDX-License-Identifier: Apache-2.0
// Traces as the reader of the MCAP project sees them, through the schemas that are in the file: nothing of
// daemon/trace but the writer takes part.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kTicksPerChunk = 20;
constexpr std::int64_t kRealtimeOffset_ns = 1'700'000'000'123'456'789;

/// The output of read_trace.mjs for a file.
struct Read {
  Finished finished;
  std::map<std::string, std::map<std::string, std::vector<Json>>> messages;  ///< by reader and topic
  std::map<std::string, Json> constants;                                     ///< by topic
  std::vector<Json> others;
};

Read readTrace(const fs::path& file) {
  Read read;
  read.finished = runToEnd({NODE_PROGRAM, READ_TRACE, file.string()});
  std::istringstream lines(read.finished.output);
  for (std::string line; std::getline(lines, line);) {
    Json json = Json::parse(line);
    if (json.contains("reader")) {
      read.messages[json["reader"]][json["topic"]].push_back(std::move(json));
    } else if (json.contains("channel")) {
      read.constants[json["channel"]] = json["constants"];
    } else {
      read.others.push_back(std::move(json));
    }
  }
  return read;
}

/// Whether the bits are equal; all NaN are equal.
bool isNumber(const Json& json, double value) {
  const double read = std::strtod(json.get<std::string>().c_str(), nullptr);
  return std::isnan(value) ? std::isnan(read) : std::memcmp(&read, &value, sizeof read) == 0;
}

/// Compares the members of one message; end() reports what was not compared.
class Members {
 public:
  explicit Members(const Json& message) : message_(message) {}

  void is(const std::string& name, std::integral auto value) {
    EXPECT_EQ(take(name), std::to_string(value)) << name;
  }
  void is(const std::string& name, bool value) { EXPECT_EQ(take(name), value) << name; }
  void is(const std::string& name, double value) { EXPECT_TRUE(isNumber(take(name), value)) << name; }
  void is(const std::string& name, const std::string& value) { EXPECT_EQ(take(name), value) << name; }
  template <typename Enumeration>
  requires std::is_enum_v<Enumeration>
  void is(const std::string& name, Enumeration value) { is(name, static_cast<std::uint8_t>(value)); }
  void is(const std::string& name, const rt::Vec3& value) { is(name, std::array{value.x, value.y, value.z}); }
  void is(const std::string& name, const rt::Quaternion& q) {
    for (const auto& [axis, value] : {std::pair{"_x", q.x}, {"_y", q.y}, {"_z", q.z}, {"_w", q.w}})
      is(name + axis, value);
  }
  template <std::size_t kCount>
  void is(const std::string& name, const std::array<double, kCount>& values) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), kCount) << name;
    for (std::size_t i = 0; i < kCount; ++i) EXPECT_TRUE(isNumber(json[i], values[i])) << name << " " << i;
  }
  void is(const std::string& name, const std::vector<std::pair<std::string, std::string>>& value) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), value.size()) << name;
    for (std::size_t i = 0; i < value.size(); ++i) {
      EXPECT_EQ(json[i], Json({{"name", value[i].first}, {"value", value[i].second}})) << name;
    }
  }
  /// `paths`: "tick.mode, tick.handle.buttons", of the values, which the messages call mode and
  /// handle_buttons.
  void are(std::string_view paths, const auto&... values) {
    const auto next = [&paths] {
      std::string name(paths.substr(0, paths.find(',')));
      paths.remove_prefix(std::min(name.size() + 2, paths.size()));
      name.erase(0, name.find('.') + 1);
      std::ranges::replace(name, '.', '_');
      return name;
    };
    (is(next(), values), ...);
  }
  void time(std::int64_t monotonic_ns) {
    const std::uint64_t realtime_ns =
        static_cast<std::uint64_t>(monotonic_ns) + static_cast<std::uint64_t>(kRealtimeOffset_ns);
    EXPECT_EQ(take("stamp"),
              Json({{"sec", std::to_string(static_cast<std::int32_t>(realtime_ns / 1'000'000'000))},
                    {"nanosec", std::to_string(realtime_ns % 1'000'000'000)}}));
  }
  void bytes(const std::string& name, const void* data, std::size_t size) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), size) << name;
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_EQ(json[i], std::to_string(static_cast<const unsigned char*>(data)[i])) << name << " " << i;
    }
  }
  /// `image`: two bytes each.
  void rawValues(const std::string& name, const std::string& image) {
    const Json json = take(name);
    ASSERT_EQ(2 * json.size(), image.size()) << name;
    for (std::size_t i = 0; i < json.size(); ++i) {
      std::uint16_t raw = 0;
      std::memcpy(&raw, image.data() + 2 * i, sizeof raw);
      EXPECT_EQ(json[i], std::to_string(raw)) << name << " " << i;
    }
  }
  void end() const { EXPECT_TRUE(message_.empty()) << message_; }

 private:
  Json take(const std::string& name) {
    const auto found = message_.find(name);
    if (found == message_.end()) {
      ADD_FAILURE() << "no member " << name;
      return Json("");
    }
    Json json = std::move(*found);
    message_.erase(found);
    return json;
  }

  Json message_;
};

#define EXPECT_MEMBERS(...) members.are(#__VA_ARGS__, __VA_ARGS__)

void expectMembers(Members& members, const rt::Tick& tick) {
  members.time(tick.planned_ns);
  EXPECT_MEMBERS(tick.number, tick.planned_ns, tick.wakeup_latency_ns, tick.compute_ns,
                 tick.directive_generation, tick.trace_dropped, tick.mode, tick.cause);
  EXPECT_MEMBERS(tick.slew_limited, tick.magnitude_clamped, tick.not_finite, tick.released,
                 tick.passivity_acted, tick.thermally_limited, tick.outside_model, tick.stopping,
                 tick.after_overrun, tick.blending);
  EXPECT_MEMBERS(tick.law, tick.contact, tick.points_used, tick.scene_frame, tick.scene_model,
                 tick.scene_age_ns);
  EXPECT_MEMBERS(tick.handle.position_m_in_world, tick.handle.velocity_m_per_s_in_world, tick.handle.sequence,
                 tick.handle.time_ns, tick.handle.session, tick.handle.condition, tick.handle.buttons,
                 tick.handle.delay_s, tick.handle.command_latency_ns, tick.handle.damps,
                 tick.handle.velocity_claim, tick.handle.probes, tick.handle.has_orientation,
                 tick.handle.has_gripper, tick.handle.orientation_in_world, tick.handle.gripper_rad);
  EXPECT_MEMBERS(tick.hip_m_in_world, tick.proxy_m_in_world, tick.gain, tick.energy_j,
                 tick.stiffness_limit_n_per_m, tick.stiffness_gain, tick.stiffness_rule,
                 tick.contact_damping_n_s_per_m);
  EXPECT_MEMBERS(tick.law_force_n_in_world, tick.blended_force_n_in_world, tick.damped_force_n_in_world,
                 tick.scaled_force_n_in_world, tick.passive_force_n_in_world, tick.filtered_force_n_in_world,
                 tick.slewed_force_n_in_world, tick.command_force_n_in_world);
  EXPECT_MEMBERS(tick.fixture_generation, tick.fixtures_in_contact, tick.nearest_fixture,
                 tick.fixture_distance_m, tick.fixture_proxy_m_in_world, tick.fixture_force_n_in_world,
                 tick.guidance_force_n_in_world, tick.tissue_generation, tick.tissue_region,
                 tick.cue_force_n_in_world, tick.external_force_n_in_world);
  EXPECT_MEMBERS(tick.stiffness_n_per_m, tick.stiffness_bound, tick.surface_noise_m, tick.hidden_latency_s,
                 tick.depth_share, tick.frame_pose);
}

void expectMembers(Members& members, const trace::ModelRecord& model) {
  members.time(model.time_ns);
  EXPECT_MEMBERS(model.model, model.time_ns, model.build_ns, model.frame, model.frame_time_ns,
                 model.device_ticks, model.centre_m_in_world, model.radius_m, model.generation, model.forgot,
                 model.depth_recorded, model.points, model.points_over_capacity, model.frames,
                 model.skipped_frames, model.damaged_frames);
}

void expectMembers(Members& members, const trace::DirectiveRecord& directive) {
  members.time(directive.time_ns);
  EXPECT_MEMBERS(directive.time_ns, directive.generation, directive.engage, directive.engage_inside,
                 directive.engage_request, directive.standoff_clearance_m, directive.parameters);
}

void expectMembers(Members& members, const trace::AdditionsRecord& additions) {
  members.time(additions.time_ns);
  EXPECT_MEMBERS(additions.time_ns, additions.fixture_generation, additions.tissue_generation,
                 additions.tool_radius_m, additions.text, additions.label_width_px, additions.label_height_px,
                 additions.fixtures, additions.regions);
  members.bytes("labels", additions.labels.bytes.data(), additions.labels.bytes.size());
}

void expectMembers(Members& members, const trace::PoseRecord& pose) {
  members.time(pose.time_ns);
  EXPECT_MEMBERS(pose.time_ns, pose.number, pose.frame, pose.pose_time_ns, pose.position_m_in_world,
                 pose.orientation_x, pose.orientation_y, pose.orientation_z, pose.orientation_w,
                 pose.has_velocity, pose.velocity_m_per_s_in_world);
}

void expectMembers(Members& members, const trace::EventRecord& event) {
  members.time(event.time_ns);
  EXPECT_MEMBERS(event.time_ns, event.kind, event.text, event.fields);
}

void expectMembers(Members& members, const trace::SnapshotRecord& record) {
  members.time(record.time_ns);
  const rt::CoreSnapshot& snapshot = record.snapshot;
  EXPECT_MEMBERS(record.time_ns, snapshot.request, snapshot.tick);
  members.is("memory_layout", 7);
  members.bytes("memory", &snapshot.memory, sizeof snapshot.memory);
}

void expectMembers(Members& members, const trace::DepthRecord& depth) {
  const rt::DepthFrameHeader& header = depth.header;
  members.time(header.arrival_ns);
  members.bytes("magic", header.magic.data(), header.magic.size());
  members.is("header_version", header.version);
  EXPECT_MEMBERS(header.header_bytes, header.width_px, header.height_px, header.stride_bytes, header.raw_type,
                 header.depth_law, header.noise, header.principle, header.raw_no_measurement,
                 header.device_ticks, header.depth_law_coefficients, header.fx_px, header.fy_px, header.cx_px,
                 header.cy_px, header.rotation_world_camera, header.position_m_in_world,
                 header.noise_coefficients, header.exposure_ns, header.arrival_ns, header.frame,
                 header.device_tick_hz, header.standing_share, header.correlation_px);
  members.bytes("serial", header.serial.data(), header.serial.size());
  EXPECT_MEMBERS(depth.raw_crc32, depth.encoding);
  members.bytes("image", depth.image.bytes.data(), depth.image.bytes.size());
  // what the reader of the MCAP project has made of it by the comments of the schema
  std::string image;
  EXPECT_EQ(trace::DepthDecoder().decode(depth, image), "");
  members.rawValues("values", image);
}

/// The indexed reader gives messages by their times, and those of one time in any order.
template <typename Record>
void expectRecords(std::vector<Json> messages, std::vector<Record> records) {
  ASSERT_EQ(messages.size(), records.size());
  const auto timeOfMessage = [](const Json& json) { return std::stoull(json["logTime"].get<std::string>()); };
  std::ranges::sort(messages, {}, timeOfMessage);
  std::ranges::sort(records, {}, [](const Record& record) { return trace::timeOf(record); });
  for (std::size_t i = 0; i < records.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(timeOfMessage(messages[i]), static_cast<std::uint64_t>(trace::timeOf(records[i])) +
                                              static_cast<std::uint64_t>(kRealtimeOffset_ns));
    Members members(messages[i]["message"]);
    expectMembers(members, records[i]);
    members.end();
  }
}

void expectAll(Read& read, const MadeUpRecords& records) {
  EXPECT_EQ(read.finished.ending, exitedWith(0)) << read.finished.errors;
  for (const char* reader : {"indexed", "stream"}) {
    SCOPED_TRACE(reader);
    auto& messages = read.messages[reader];
    expectRecords(messages["/hapticd/tick"], records.ticks);
    expectRecords(messages["/hapticd/model"], records.models);
    expectRecords(messages["/hapticd/directive"], records.directives);
    expectRecords(messages["/hapticd/additions"], records.additions);
    expectRecords(messages["/hapticd/frame_pose"], records.poses);
    expectRecords(messages["/hapticd/event"], records.events);
    expectRecords(messages["/hapticd/core_snapshot"], records.snapshots);
    expectRecords(messages["/hapticd/depth"], records.depth);
    EXPECT_EQ(messages.size(), 8U);
  }
}

class TraceReader : public testing::Test {
 protected:
  /// install_packages has left the reason where npm's registry cannot be reached or trusted.
  void SetUp() override {
    if (fs::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  }

  /// A closed trace of three chunks.
  fs::path writeTrace(bool compress) {
    const fs::path file = folder_.path() / "a.mcap";
    test::writeTrace(file, records_, kTicksPerChunk,
                     {.compress = compress,
                      .realtime_offset_ns = kRealtimeOffset_ns,
                      .metadata = {{"version", "1.2"}, {"kernel", "ä"}},
                      .attachments = {{"hapticd.yaml", "application/yaml", "a: 1\n"}}});
    return file;
  }

  TemporaryFolder folder_;
  static MadeUpRecords recordsWithDepth() {
    MadeUpRecords records = madeUpRecords(3, kTicksPerChunk, 7);
    std::mt19937_64 random(8);
    for (int i = 0; i < 5; ++i) {
      records.depth.push_back(madeUpDepth(random));
      records.depth.back().header.arrival_ns = i;  // in the first chunk
    }
    return records;
  }

  MadeUpRecords records_ = recordsWithDepth();
};

TEST_F(TraceReader, ReadsEveryMemberOfEveryMessage) {
  for (const bool compress : {true, false}) {
    SCOPED_TRACE(compress);
    const fs::path file = writeTrace(compress);
    Read read = readTrace(file);
    expectAll(read, records_);
    fs::remove(file);
  }
}

TEST_F(TraceReader, ReadsOrdinaryTicksToo) {
  records_ = {};
  rt::Tick tick;  // as the loop leaves it at first
  tick.number = 1;
  records_.ticks.push_back(tick);
  tick.number = 2;
  tick.planned_ns = 1'000'000;
  tick.mode = rt::Mode::engaged;
  tick.cause = rt::Cause::requested;
  tick.command_force_n_in_world = {0.1, -2.5, 1e-300};
  tick.handle.position_m_in_world = {0.01, 0.02, -0.7};
  records_.ticks.push_back(tick);
  Read read = readTrace(writeTrace(true));
  ASSERT_EQ(read.finished.ending, exitedWith(0)) << read.finished.errors;
  expectRecords(read.messages["indexed"]["/hapticd/tick"], records_.ticks);
}

TEST_F(TraceReader, FindsTheNamesOfTheModesInTheSchema) {
  const Read read = readTrace(writeTrace(true));
  const Json& constants = read.constants.at("/hapticd/tick");
  const auto is = [&](const char* name, auto value) {
    EXPECT_EQ(constants[name], std::to_string(static_cast<int>(value))) << name;
  };
  is("MODE_STARTING", rt::Mode::starting);
  is("MODE_FAULTED", rt::Mode::faulted);
  is("CAUSE_OVERRUN_BURST", rt::Cause::overrun_burst);
  is("LAW_SURFACE", rt::ForceLaw::surface);
  is("CONTACT_CONTACT", rt::ContactState::contact);
  is("HANDLE_CONDITION_NOT_CALIBRATED", rt::HandleCondition::not_calibrated);
  // laws, contact states, conditions of the handle, rules of the stiffness limit, bounds of the stiffness,
  // sources of the velocity
  EXPECT_EQ(constants.size(), rt::kModeCount + rt::kCauseCount + 4 + 4 + 3 + 3 + 6 + 4);
}

TEST_F(TraceReader, FindsMetadataAndAttachments) {
  const Read read = readTrace(writeTrace(true));
  const std::vector<Json> expected{
      {{"metadata", "hapticd_trace"},
       {"values", {{"version", "1"}, {"realtime_offset_ns", std::to_string(kRealtimeOffset_ns)}}}},
      {{"metadata", "hapticd"}, {"values", {{"version", "1.2"}, {"kernel", "ä"}}}},
      {{"attachment", "hapticd.yaml"}, {"mediaType", "application/yaml"}, {"data", "a: 1\n"}}};
  EXPECT_EQ(read.others, expected);
}

TEST_F(TraceReader, ReadsWhatWasRecovered) {
  const std::string whole = contentOf(writeTrace(true));
  // cut off within its third chunk
  const fs::path recovered_path = folder_.path() / "c.mcap";
  fs::path part;
  base::Result<trace::RecoveredTrace> recovered;
  std::size_t size = whole.size();
  do {
    size -= whole.size() / 50;
    part = folder_.write("b.mcap.part", whole.substr(0, size));
    fs::remove(recovered_path);
    recovered = trace::recoverTrace(part, recovered_path);
    ASSERT_TRUE(recovered) << recovered.error().text();
  } while (recovered->chunks > 2);
  EXPECT_EQ(readTrace(part).finished.ending, exitedWith(1)) << "before that it is cut off";
  ASSERT_EQ(recovered->chunks, 2U);
  MadeUpRecords expected = records_;
  expected.ticks.resize(2 * kTicksPerChunk);
  Read read = readTrace(recovered->file);
  expectAll(read, expected);
}

}  // namespace
}  // namespace hapticd::test
