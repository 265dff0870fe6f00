// SPDX-License-Identifier: Apache-2.0
// Traces as the reader of the MCAP project sees them, through the schemas that are in the file: nothing of
// daemon/trace but the writer takes part.

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

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

std::string text(std::uint64_t value) {
  return std::to_string(value);
}
std::string text(std::int64_t value) {
  return std::to_string(value);
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

  void number(const std::string& name, std::uint64_t value) { EXPECT_EQ(take(name), text(value)) << name; }
  void number(const std::string& name, std::int64_t value) { EXPECT_EQ(take(name), text(value)) << name; }
  void number(const std::string& name, std::int32_t value) { number(name, std::int64_t{value}); }
  void number(const std::string& name, std::uint32_t value) { number(name, std::uint64_t{value}); }
  void number(const std::string& name, double value) { EXPECT_TRUE(isNumber(take(name), value)) << name; }
  void flag(const std::string& name, bool value) { EXPECT_EQ(take(name), value) << name; }
  void string(const std::string& name, const std::string& value) { EXPECT_EQ(take(name), value) << name; }
  template <typename Enumeration>
  void enumerator(const std::string& name, Enumeration value) {
    number(name, std::uint64_t{static_cast<std::uint8_t>(value)});
  }
  void vector(const std::string& name, const rt::Vec3& value) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), 3U) << name;
    EXPECT_TRUE(isNumber(json[0], value.x) && isNumber(json[1], value.y) && isNumber(json[2], value.z))
        << name << " " << json;
  }
  void pairs(const std::string& name, const std::vector<std::pair<std::string, std::string>>& value) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), value.size()) << name;
    for (std::size_t i = 0; i < value.size(); ++i) {
      EXPECT_EQ(json[i], Json({{"name", value[i].first}, {"value", value[i].second}})) << name;
    }
  }
  void time(std::int64_t monotonic_ns) {
    const std::uint64_t realtime_ns =
        static_cast<std::uint64_t>(monotonic_ns) + static_cast<std::uint64_t>(kRealtimeOffset_ns);
    EXPECT_EQ(take("stamp"),
              Json({{"sec", std::to_string(static_cast<std::int32_t>(realtime_ns / 1'000'000'000))},
                    {"nanosec", text(realtime_ns % 1'000'000'000)}}));
  }
  void bytes(const std::string& name, const void* data, std::size_t size) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), size) << name;
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_EQ(json[i], std::to_string(static_cast<const unsigned char*>(data)[i])) << name << " " << i;
    }
  }
  template <std::size_t kCount>
  void numbers(const std::string& name, const std::array<double, kCount>& values) {
    const Json json = take(name);
    ASSERT_EQ(json.size(), kCount) << name;
    for (std::size_t i = 0; i < kCount; ++i) EXPECT_TRUE(isNumber(json[i], values[i])) << name << " " << i;
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

void expectHandle(Members& members, const rt::HandleState& handle) {
  members.vector("handle_position_m_in_world", handle.position_m_in_world);
  members.vector("handle_velocity_m_per_s_in_world", handle.velocity_m_per_s_in_world);
  members.number("handle_sequence", handle.sequence);
  members.number("handle_time_ns", handle.time_ns);
  members.number("handle_session", handle.session);
  members.enumerator("handle_condition", handle.condition);
  members.number("handle_buttons", handle.buttons);
  members.number("handle_delay_s", handle.delay_s);
  members.number("handle_command_latency_ns", handle.command_latency_ns);
  members.flag("handle_damps", handle.damps);
  members.enumerator("handle_velocity_claim", handle.velocity_claim);
  members.flag("handle_probes", handle.probes);
  members.flag("handle_has_orientation", handle.has_orientation);
  members.flag("handle_has_gripper", handle.has_gripper);
  members.number("handle_orientation_in_world_x", handle.orientation_in_world.x);
  members.number("handle_orientation_in_world_y", handle.orientation_in_world.y);
  members.number("handle_orientation_in_world_z", handle.orientation_in_world.z);
  members.number("handle_orientation_in_world_w", handle.orientation_in_world.w);
  members.number("handle_gripper_rad", handle.gripper_rad);
}

void expectFlags(Members& members, const rt::Tick& tick) {
  members.flag("slew_limited", tick.slew_limited);
  members.flag("magnitude_clamped", tick.magnitude_clamped);
  members.flag("not_finite", tick.not_finite);
  members.flag("released", tick.released);
  members.flag("passivity_acted", tick.passivity_acted);
  members.flag("thermally_limited", tick.thermally_limited);
  members.flag("outside_model", tick.outside_model);
  members.flag("stopping", tick.stopping);
  members.flag("after_overrun", tick.after_overrun);
  members.flag("blending", tick.blending);
}

void expectForces(Members& members, const rt::Tick& tick) {
  members.vector("law_force_n_in_world", tick.law_force_n_in_world);
  members.vector("blended_force_n_in_world", tick.blended_force_n_in_world);
  members.vector("damped_force_n_in_world", tick.damped_force_n_in_world);
  members.vector("scaled_force_n_in_world", tick.scaled_force_n_in_world);
  members.vector("passive_force_n_in_world", tick.passive_force_n_in_world);
  members.vector("filtered_force_n_in_world", tick.filtered_force_n_in_world);
  members.vector("slewed_force_n_in_world", tick.slewed_force_n_in_world);
  members.vector("command_force_n_in_world", tick.command_force_n_in_world);
}

void expectAdditions(Members& members, const rt::Tick& tick) {
  members.number("fixture_generation", tick.fixture_generation);
  members.number("fixtures_in_contact", tick.fixtures_in_contact);
  members.number("nearest_fixture", tick.nearest_fixture);
  members.number("fixture_distance_m", tick.fixture_distance_m);
  members.vector("fixture_proxy_m_in_world", tick.fixture_proxy_m_in_world);
  members.vector("fixture_force_n_in_world", tick.fixture_force_n_in_world);
  members.vector("guidance_force_n_in_world", tick.guidance_force_n_in_world);
  members.number("tissue_generation", tick.tissue_generation);
  members.number("tissue_region", tick.tissue_region);
  members.vector("cue_force_n_in_world", tick.cue_force_n_in_world);
  members.vector("external_force_n_in_world", tick.external_force_n_in_world);
  members.number("stiffness_n_per_m", tick.stiffness_n_per_m);
  members.enumerator("stiffness_bound", tick.stiffness_bound);
  members.number("surface_noise_m", tick.surface_noise_m);
  members.number("hidden_latency_s", tick.hidden_latency_s);
  members.number("depth_share", tick.depth_share);
  members.number("frame_pose", tick.frame_pose);
}

void expectMembers(Members& members, const rt::Tick& tick) {
  members.time(tick.planned_ns);
  members.number("number", tick.number);
  members.number("planned_ns", tick.planned_ns);
  members.number("wakeup_latency_ns", tick.wakeup_latency_ns);
  members.number("compute_ns", tick.compute_ns);
  members.number("directive_generation", tick.directive_generation);
  members.number("trace_dropped", tick.trace_dropped);
  members.enumerator("mode", tick.mode);
  members.enumerator("cause", tick.cause);
  expectFlags(members, tick);
  members.enumerator("law", tick.law);
  members.enumerator("contact", tick.contact);
  members.number("points_used", tick.points_used);
  members.number("scene_frame", tick.scene_frame);
  members.number("scene_model", tick.scene_model);
  members.number("scene_age_ns", tick.scene_age_ns);
  expectHandle(members, tick.handle);
  members.vector("hip_m_in_world", tick.hip_m_in_world);
  members.vector("proxy_m_in_world", tick.proxy_m_in_world);
  members.number("gain", tick.gain);
  members.number("energy_j", tick.energy_j);
  members.number("stiffness_limit_n_per_m", tick.stiffness_limit_n_per_m);
  members.number("stiffness_gain", tick.stiffness_gain);
  members.enumerator("stiffness_rule", tick.stiffness_rule);
  members.number("contact_damping_n_s_per_m", tick.contact_damping_n_s_per_m);
  expectForces(members, tick);
  expectAdditions(members, tick);
}

void expectMembers(Members& members, const trace::ModelRecord& model) {
  members.time(model.time_ns);
  members.number("model", model.model);
  members.number("time_ns", model.time_ns);
  members.number("build_ns", model.build_ns);
  members.number("frame", model.frame);
  members.number("frame_time_ns", model.frame_time_ns);
  members.number("device_ticks", model.device_ticks);
  members.vector("centre_m_in_world", model.centre_m_in_world);
  members.number("radius_m", model.radius_m);
  members.number("generation", model.generation);
  members.flag("forgot", model.forgot);
  members.flag("depth_recorded", model.depth_recorded);
  members.number("points", model.points);
  members.number("points_over_capacity", model.points_over_capacity);
  members.number("frames", model.frames);
  members.number("skipped_frames", model.skipped_frames);
  members.number("damaged_frames", model.damaged_frames);
}

void expectMembers(Members& members, const trace::DirectiveRecord& directive) {
  members.time(directive.time_ns);
  members.number("time_ns", directive.time_ns);
  members.number("generation", directive.generation);
  members.flag("engage", directive.engage);
  members.flag("engage_inside", directive.engage_inside);
  members.number("engage_request", directive.engage_request);
  members.number("standoff_clearance_m", directive.standoff_clearance_m);
  members.pairs("parameters", directive.parameters);
}

void expectMembers(Members& members, const trace::AdditionsRecord& additions) {
  members.time(additions.time_ns);
  members.number("time_ns", additions.time_ns);
  members.number("fixture_generation", additions.fixture_generation);
  members.number("tissue_generation", additions.tissue_generation);
  members.number("tool_radius_m", additions.tool_radius_m);
  members.string("text", additions.text);
  members.bytes("labels", additions.labels.bytes.data(), additions.labels.bytes.size());
  members.number("label_width_px", additions.label_width_px);
  members.number("label_height_px", additions.label_height_px);
  members.pairs("fixtures", additions.fixtures);
  members.pairs("regions", additions.regions);
}

void expectMembers(Members& members, const trace::PoseRecord& pose) {
  members.time(pose.time_ns);
  members.number("time_ns", pose.time_ns);
  members.number("number", pose.number);
  members.number("frame", pose.frame);
  members.number("pose_time_ns", pose.pose_time_ns);
  members.vector("position_m_in_world", pose.position_m_in_world);
  members.number("orientation_x", pose.orientation_x);
  members.number("orientation_y", pose.orientation_y);
  members.number("orientation_z", pose.orientation_z);
  members.number("orientation_w", pose.orientation_w);
  members.flag("has_velocity", pose.has_velocity);
  members.vector("velocity_m_per_s_in_world", pose.velocity_m_per_s_in_world);
}

void expectMembers(Members& members, const trace::EventRecord& event) {
  members.time(event.time_ns);
  members.number("time_ns", event.time_ns);
  members.string("kind", event.kind);
  members.string("text", event.text);
  members.pairs("fields", event.fields);
}

void expectMembers(Members& members, const trace::SnapshotRecord& record) {
  members.time(record.time_ns);
  members.number("time_ns", record.time_ns);
  members.number("request", record.snapshot.request);
  members.number("tick", record.snapshot.tick);
  members.number("memory_layout", std::uint64_t{7});
  members.bytes("memory", &record.snapshot.memory, sizeof record.snapshot.memory);
}

void expectMembers(Members& members, const trace::DepthRecord& depth) {
  const rt::DepthFrameHeader& header = depth.header;
  members.time(header.arrival_ns);
  members.bytes("magic", header.magic.data(), header.magic.size());
  members.number("header_version", std::uint32_t{header.version});
  members.number("header_bytes", std::uint32_t{header.header_bytes});
  members.number("width_px", header.width_px);
  members.number("height_px", header.height_px);
  members.number("stride_bytes", header.stride_bytes);
  members.enumerator("raw_type", header.raw_type);
  members.enumerator("depth_law", header.depth_law);
  members.enumerator("noise", header.noise);
  members.enumerator("principle", header.principle);
  members.number("raw_no_measurement", header.raw_no_measurement);
  members.number("device_ticks", header.device_ticks);
  members.numbers("depth_law_coefficients", header.depth_law_coefficients);
  members.number("fx_px", header.fx_px);
  members.number("fy_px", header.fy_px);
  members.number("cx_px", header.cx_px);
  members.number("cy_px", header.cy_px);
  members.numbers("rotation_world_camera", header.rotation_world_camera);
  members.numbers("position_m_in_world", header.position_m_in_world);
  members.numbers("noise_coefficients", header.noise_coefficients);
  members.number("exposure_ns", header.exposure_ns);
  members.number("arrival_ns", header.arrival_ns);
  members.number("frame", header.frame);
  members.number("device_tick_hz", header.device_tick_hz);
  members.bytes("serial", header.serial.data(), header.serial.size());
  members.number("standing_share", header.standing_share);
  members.number("correlation_px", header.correlation_px);
  members.number("raw_crc32", depth.raw_crc32);
  members.enumerator("encoding", depth.encoding);
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
  EXPECT_EQ(constants["MODE_STARTING"], text(std::uint64_t{static_cast<std::uint8_t>(rt::Mode::starting)}));
  EXPECT_EQ(constants["MODE_FAULTED"], text(std::uint64_t{static_cast<std::uint8_t>(rt::Mode::faulted)}));
  EXPECT_EQ(constants["CAUSE_OVERRUN_BURST"],
            text(std::uint64_t{static_cast<std::uint8_t>(rt::Cause::overrun_burst)}));
  EXPECT_EQ(constants["LAW_SURFACE"], text(std::uint64_t{static_cast<std::uint8_t>(rt::ForceLaw::surface)}));
  EXPECT_EQ(constants["CONTACT_CONTACT"],
            text(std::uint64_t{static_cast<std::uint8_t>(rt::ContactState::contact)}));
  EXPECT_EQ(constants["HANDLE_CONDITION_NOT_CALIBRATED"],
            text(std::uint64_t{static_cast<std::uint8_t>(rt::HandleCondition::not_calibrated)}));
  // laws, contact states, conditions of the handle, rules of the stiffness limit, bounds of the stiffness,
  // sources of the velocity
  EXPECT_EQ(constants.size(), rt::kModeCount + rt::kCauseCount + 4 + 4 + 3 + 3 + 6 + 4);
}

TEST_F(TraceReader, FindsMetadataAndAttachments) {
  const Read read = readTrace(writeTrace(true));
  const std::vector<Json> expected{
      {{"metadata", "hapticd_trace"},
       {"values", {{"version", "1"}, {"realtime_offset_ns", text(kRealtimeOffset_ns)}}}},
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
