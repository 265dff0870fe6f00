// SPDX-License-Identifier: Apache-2.0
// Bags of ROS 2 made of traces, as the reader of the MCAP project and a decoder of .msg definitions see them,
// number by number against the ticks of the trace.

#include "tools/lib/ros/ros_bag.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::int64_t kOffset_ns = 1'700'000'000'123'456'789;
constexpr std::int64_t kPeriod_ns = 1'000'000;
/// Long enough for several chunks.
constexpr std::uint64_t kTicks = 9000;
/// Each such tick has no new measurement, as of a handle at less than 1 kHz.
constexpr std::uint64_t kSlow = 7;

constexpr const char* kSettings =
    "camera:\n  position_x_m: 0.5\n  position_y_m: 0.25\n  position_z_m: 1\n  roll_rad: 0\n  pitch_rad: 0\n"
    "  yaw_rad: 0\n"
    "handle:\n  position_x_m: 1\n  position_y_m: 2\n  position_z_m: 3\n  roll_rad: 0\n  pitch_rad: 0\n"
    "  yaw_rad: 3.141592653589793\n";

rt::Tick tickOf(std::uint64_t number) {
  const auto n = static_cast<double>(number);
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = 5'000'000'000 + static_cast<std::int64_t>(number) * kPeriod_ns;
  tick.mode = number < 100 ? rt::Mode::starting : number < 4000 ? rt::Mode::engaged : rt::Mode::faulted;
  tick.command_force_n_in_world = {0.1 + n, -n / 3, 1 / (n + 1)};
  if (number == 50) tick.command_force_n_in_world.y = std::numeric_limits<double>::quiet_NaN();
  const std::uint64_t measurement = number - (number % kSlow == 0 ? 1 : 0);
  const auto m = static_cast<double>(measurement);
  rt::HandleState& handle = tick.handle;
  handle.sequence = measurement;
  handle.time_ns = 5'000'000'000 + static_cast<std::int64_t>(measurement) * kPeriod_ns - 2'313'131;
  handle.position_m_in_world = {0.001 * m, -0.2, m / 7};
  handle.velocity_m_per_s_in_world = {std::sin(m), std::cos(m), 1e-300};
  if (number < 30) handle.condition = rt::HandleCondition::not_calibrated;
  handle.has_orientation = number >= 500;
  handle.orientation_in_world = {0.5, -0.5, 0.5, -0.5};
  handle.has_gripper = number >= 2500;
  handle.gripper_rad = 0.25;
  handle.buttons = number == 700 ? 0b100001 : 0;
  return tick;
}

constexpr std::uint32_t kWidth = 3, kHeight = 2;
const std::vector<std::uint16_t> kRaw{0, 1083, 1000, 600, 1090, 2047};

/// Frames of a Kinect v1, three values of padding in each row; the camera is moved before the second.
rt::DepthFrameHeader cameraOf(std::uint64_t frame) {
  rt::DepthFrameHeader camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.stride_bytes = 2 * (kWidth + 3);
  camera.depth_law = rt::DepthLawKind::reciprocal;
  camera.depth_law_coefficients = {-0.0030711016, 3.3309495161};
  camera.raw_no_measurement = 2047;
  camera.fx_px = 594.25;
  camera.fy_px = 591.5;
  camera.cx_px = 339.5;
  camera.cy_px = 242.75;
  camera.rotation_world_camera = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  camera.position_m_in_world = {0.5, 0.25, frame < 2 ? 1.0 : 1.125};
  camera.frame = frame;
  camera.arrival_ns = 5'000'000'000 + static_cast<std::int64_t>(frame) * 33'000'000;
  camera.exposure_ns = frame == 3 ? 0 : camera.arrival_ns - 21'000'000;
  return camera;
}
constexpr std::uint64_t kFrames = 3;

void writeDepth(trace::TraceWriter& writer) {
  std::vector<std::uint16_t> padded;
  for (std::size_t i = 0; i < kRaw.size(); ++i) {
    padded.push_back(kRaw[i]);
    if (i % kWidth == kWidth - 1) padded.insert(padded.end(), 3, 2047);
  }
  trace::DepthEncoder encoder;
  for (std::uint64_t frame = 1; frame <= kFrames; ++frame) {
    trace::DepthRecord record;
    encoder.encode(cameraOf(frame), std::as_bytes(std::span(padded)), record);
    ASSERT_TRUE(writer.write(record));
  }
}

void writeRealisticTrace(const fs::path& file, bool depth) {
  const auto writer =
      trace::TraceWriter::create(file, {.realtime_offset_ns = kOffset_ns,
                                        .attachments = {{"settings.yaml", "application/yaml", kSettings}},
                                        .depth = depth});
  ASSERT_TRUE(writer) << writer.error().text();
  for (std::uint64_t number = 1; number <= kTicks; ++number) {
    ASSERT_TRUE((*writer)->write(tickOf(number)));
    if (number == 200 && depth) writeDepth(**writer);
    if (number % 3000 == 1) {
      const bool ends = number > 3000;
      const trace::EventRecord event{.time_ns = tickOf(number).planned_ns,
                                     .kind = number > 6000 ? "mode" : "warning",
                                     .text = "event " + std::to_string(number),
                                     .fields = {{"STATE", ends ? "end" : "begin"}}};
      ASSERT_TRUE((*writer)->write(event));
    }
  }
  const auto closed = (*writer)->close();
  ASSERT_TRUE(closed) << closed.error().text();
}

/// A bag as read_trace.mjs prints it.
struct Bag {
  Finished finished;
  std::map<std::string, std::map<std::string, std::vector<Json>>> messages;  ///< by reader and topic
  std::map<std::string, Json> channels;                                      ///< by topic
  Json metadata;
  Json profile;
};

Bag readBag(const fs::path& file) {
  Bag bag;
  bag.finished = runToEnd({NODE_PROGRAM, READ_TRACE, file.string()});
  std::istringstream lines(bag.finished.output);
  for (std::string line; std::getline(lines, line);) {
    Json json = Json::parse(line);
    if (json.contains("reader")) {
      bag.messages[json["reader"]][json["topic"]].push_back(std::move(json));
    } else if (json.contains("channel")) {
      bag.channels[json["channel"]] = json;
    } else if (json.contains("profile")) {
      bag.profile = json["profile"];
    } else if (json.contains("metadata")) {
      bag.metadata[json["metadata"].get<std::string>()] = json["values"];
    }
  }
  return bag;
}

/// Whether the bits of the number are those of `value`.
void expectNumber(const Json& json, double value) {
  const double read = std::strtod(json.get<std::string>().c_str(), nullptr);
  EXPECT_EQ(std::bit_cast<std::uint64_t>(read), std::bit_cast<std::uint64_t>(value)) << json << " " << value;
}
void expectVector(const Json& json, const rt::Vec3& value) {
  expectNumber(json.at("x"), value.x);
  expectNumber(json.at("y"), value.y);
  expectNumber(json.at("z"), value.z);
}
void expectQuaternion(const Json& json, const rt::Quaternion& q) {
  expectVector(json, {q.x, q.y, q.z});
  expectNumber(json.at("w"), q.w);
}

/// Log time and stamp are those of a time of CLOCK_MONOTONIC.
void expectTime(const Json& one, const Json& stamp, std::int64_t monotonic_ns) {
  const std::int64_t utc_ns = monotonic_ns + kOffset_ns;
  EXPECT_EQ(one.at("logTime"), std::to_string(utc_ns));
  EXPECT_EQ(stamp, Json({{"sec", std::to_string(utc_ns / 1'000'000'000)},
                         {"nanosec", std::to_string(utc_ns % 1'000'000'000)}}));
}
const Json& expectHeader(const Json& one, std::int64_t monotonic_ns, const std::string& frame) {
  const Json& message = one.at("message");
  expectTime(one, message.at("header").at("stamp"), monotonic_ns);
  EXPECT_EQ(message.at("header").at("frame_id"), frame);
  return message;
}

class RosBag : public testing::Test {
 protected:
  void SetUp() override {
    if (fs::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  }
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  /// Writes a trace and its bag, and reads the bag.
  Bag bagOf(bool depth, const std::string& name_space = "hapticd",
            const trace::TraceSelection& selection = {}) const {
    writeRealisticTrace(path("a.mcap"), depth);
    const auto content = tools::ros::exportBag(path("a.mcap"), path("bag.mcap"), name_space, selection);
    EXPECT_TRUE(content) << content.error().text();
    Bag bag = readBag(path("bag.mcap"));
    EXPECT_EQ(bag.finished.ending, exitedWith(0)) << bag.finished.errors;
    std::uint64_t messages = 0;
    for (const auto& [topic, all] : bag.messages["indexed"]) messages += all.size();
    EXPECT_EQ(content->messages, messages);
    EXPECT_EQ(content->depth_frames, depth ? kFrames : 0);
    EXPECT_EQ(bag.messages["indexed"].size(), bag.messages["stream"].size());
    return bag;
  }
  /// The ticks of the trace as hapticd's own reader has them.
  std::vector<rt::Tick> ticks() const { return recordsIn(path("a.mcap")).ticks; }

 private:
  TemporaryFolder folder_;
};

TEST_F(RosBag, HasTheTopicsTypesAndSettingsOfHapticdRos) {
  Bag bag = bagOf(/*depth=*/true, "left/arm");
  EXPECT_EQ(bag.profile, "ros2");
  const std::map<std::string, std::string> types{
      {"/left/arm/measured_cp", "geometry_msgs/msg/PoseStamped"},
      {"/left/arm/measured_cv", "geometry_msgs/msg/TwistStamped"},
      {"/left/arm/setpoint_cf", "geometry_msgs/msg/WrenchStamped"},
      {"/left/arm/operating_state", "crtk_msgs/msg/OperatingState"},
      {"/left/arm/buttons", "sensor_msgs/msg/Joy"},
      {"/left/arm/events", "rcl_interfaces/msg/Log"},
      {"/left/arm/depth/image_raw", "sensor_msgs/msg/Image"},
      {"/left/arm/depth/camera_info", "sensor_msgs/msg/CameraInfo"},
      {"/tf_static", "tf2_msgs/msg/TFMessage"}};
  EXPECT_EQ(bag.channels.size(), types.size());
  const std::set<std::string> for_late{"/left/arm/operating_state", "/tf_static"};
  for (const auto& [topic, type] : types) {
    ASSERT_TRUE(bag.channels.contains(topic)) << topic;
    const Json& channel = bag.channels[topic];
    EXPECT_EQ(channel.at("schema"), type);
    EXPECT_FALSE(bag.messages["indexed"][topic].empty()) << topic;
    const std::string qos = channel.at("metadata").at("offered_qos_profiles");
    EXPECT_TRUE(qos.starts_with("- history: 1\n  depth: ")) << qos;
    EXPECT_EQ(qos.contains("  durability: 1\n"), for_late.contains(topic)) << qos;
    EXPECT_EQ(qos.contains("  durability: 2\n"), !for_late.contains(topic)) << qos;
    EXPECT_EQ(channel.at("metadata").at("topic_type_hash").get<std::string>().size(), 71U);
  }
  EXPECT_EQ(bag.channels["/left/arm/measured_cp"].at("metadata").at("topic_type_hash"),
            "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8");
  const Json& first = bag.messages["indexed"]["/left/arm/measured_cp"].front();
  EXPECT_EQ(first.at("message").at("header").at("frame_id"), "left/arm/world");
  const std::string metadata = bag.metadata.at("rosbag2").at("serialized_metadata");
  EXPECT_TRUE(metadata.starts_with("version: 8\nstorage_identifier: mcap\n")) << metadata;
}

TEST_F(RosBag, HoldsEachTicksForceAndEachMeasurementOnceBitByBit) {
  Bag bag = bagOf(/*depth=*/false);
  EXPECT_FALSE(bag.channels.contains("/hapticd/depth/image_raw"));
  for (const char* reader : {"indexed", "stream"}) {
    auto& messages = bag.messages[reader];
    std::size_t forces = 0, measurements = 0;
    std::uint64_t last = 0;
    for (const rt::Tick& tick : ticks()) {
      if (tick.number != 50) {
        ASSERT_LT(forces, messages["/hapticd/setpoint_cf"].size());
        const Json& force =
            expectHeader(messages["/hapticd/setpoint_cf"][forces++], tick.planned_ns, "hapticd/world");
        expectVector(force.at("wrench").at("force"), tick.command_force_n_in_world);
        expectVector(force.at("wrench").at("torque"), {});
      }
      const rt::HandleState& handle = tick.handle;
      if (handle.sequence == last || tick.number < 30) continue;
      last = handle.sequence;
      ASSERT_LT(measurements, messages["/hapticd/measured_cp"].size());
      ASSERT_LT(measurements, messages["/hapticd/measured_cv"].size());
      const Json& pose =
          expectHeader(messages["/hapticd/measured_cp"][measurements], handle.time_ns, "hapticd/world");
      expectVector(pose.at("pose").at("position"), handle.position_m_in_world);
      expectQuaternion(pose.at("pose").at("orientation"),
                       handle.has_orientation ? handle.orientation_in_world : rt::Quaternion{});
      const Json& twist =
          expectHeader(messages["/hapticd/measured_cv"][measurements], handle.time_ns, "hapticd/world");
      expectVector(twist.at("twist").at("linear"), handle.velocity_m_per_s_in_world);
      expectVector(twist.at("twist").at("angular"), {});
      ++measurements;
      if (HasFailure()) return;  // one message tells it all
    }
    EXPECT_EQ(forces, kTicks - 1);
    EXPECT_EQ(messages["/hapticd/setpoint_cf"].size(), forces);
    EXPECT_EQ(messages["/hapticd/measured_cp"].size(), measurements);
    EXPECT_EQ(messages["/hapticd/measured_cv"].size(), measurements);
    EXPECT_GT(measurements, kTicks / 3);
  }
}

TEST_F(RosBag, HoldsStatesAndEventsWhenTheyChange) {
  Bag bag = bagOf(/*depth=*/false);
  const auto& states = bag.messages["indexed"]["/hapticd/operating_state"];
  struct State {
    std::uint64_t tick;
    const char* state;
    bool homed;
    bool busy;
  };
  // not calibrated before tick 30, starting before 100, engaged before 4000
  const std::vector<State> expected{{1, "DISABLED", false, true},
                                    {30, "DISABLED", true, true},
                                    {100, "ENABLED", true, false},
                                    {4000, "FAULT", true, false}};
  ASSERT_EQ(states.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Json& state = expectHeader(states[i], tickOf(expected[i].tick).planned_ns, "hapticd/world");
    EXPECT_EQ(state.at("state"), expected[i].state);
    EXPECT_EQ(state.at("is_homed"), expected[i].homed);
    EXPECT_EQ(state.at("is_busy"), expected[i].busy);
  }
  const auto& events = bag.messages["indexed"]["/hapticd/events"];
  ASSERT_EQ(events.size(), 3U);
  const std::vector<std::pair<std::string, std::string>> severities{
      {"30", "hapticd.warning"}, {"20", "hapticd.warning"}, {"20", "hapticd.mode"}};
  for (std::size_t i = 0; i < events.size(); ++i) {
    const std::uint64_t number = 3000 * i + 1;
    const Json& event = events[i].at("message");
    expectTime(events[i], event.at("stamp"), tickOf(number).planned_ns);
    EXPECT_EQ(event.at("level"), severities[i].first);
    EXPECT_EQ(event.at("name"), severities[i].second);
    EXPECT_EQ(event.at("msg"), "event " + std::to_string(number));
    EXPECT_EQ(event.at("line"), "0");
  }
}

TEST_F(RosBag, HoldsButtonsWhenTheyChangeAndOnceASecond) {
  Bag bag = bagOf(/*depth=*/false);
  const Json none = Json::parse(R"(["0","0","0","0"])"),
             six_none = Json::parse(R"(["0","0","0","0","0","0"])");
  const Json pressed = Json::parse(R"(["1","0","0","0","0","1"])");
  // a second after the change at tick 701, and so on; the gripper is there from tick 2500 on
  const std::vector<std::pair<std::uint64_t, Json>> expected{
      {1, none},        {700, pressed},   {701, six_none},  {1701, six_none},
      {2701, six_none}, {3701, six_none}, {4701, six_none}, {5701, six_none},
      {6701, six_none}, {7701, six_none}, {8701, six_none}};
  const auto& messages = bag.messages["indexed"]["/hapticd/buttons"];
  ASSERT_EQ(messages.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto& [number, held] = expected[i];
    const Json& message = expectHeader(messages[i], tickOf(number).handle.time_ns, "hapticd/world");
    EXPECT_EQ(message.at("buttons"), held) << number;
    EXPECT_EQ(message.at("axes"), number < 2500 ? Json::array() : Json::array({"0.25"})) << number;
  }
}

TEST_F(RosBag, HoldsDepthInMillimetresByTheLawOfTheCamera) {
  Bag bag = bagOf(/*depth=*/true);
  const auto& images = bag.messages["indexed"]["/hapticd/depth/image_raw"];
  const auto& infos = bag.messages["indexed"]["/hapticd/depth/camera_info"];
  ASSERT_EQ(images.size(), kFrames);
  ASSERT_EQ(infos.size(), kFrames);
  // 1/Z = -0.0030711016 raw + 3.3309495161, computed by hand; what is beyond 20 m, behind the camera or not
  // measured is 0
  const std::vector<std::string> millimetres{"300", "0", "3848", "672", "0", "0"};
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const rt::DepthFrameHeader camera = cameraOf(i + 1);
    const std::int64_t time_ns = camera.exposure_ns != 0 ? camera.exposure_ns : camera.arrival_ns;
    const Json& image = expectHeader(images[i], time_ns, "hapticd/camera_optical");
    EXPECT_EQ(image.at("width"), "3");
    EXPECT_EQ(image.at("height"), "2");
    EXPECT_EQ(image.at("encoding"), "16UC1");
    EXPECT_EQ(image.at("is_bigendian"), "0");
    EXPECT_EQ(image.at("step"), "6");
    std::vector<std::string> pixels;
    const Json& data = image.at("data");
    for (std::size_t byte = 0; byte + 1 < data.size(); byte += 2) {
      pixels.push_back(std::to_string(std::stoi(data[byte].get<std::string>()) +
                                      256 * std::stoi(data[byte + 1].get<std::string>())));
    }
    EXPECT_EQ(pixels, millimetres);
    const Json& info = expectHeader(infos[i], time_ns, "hapticd/camera_optical");
    EXPECT_EQ(info.at("width"), "3");
    EXPECT_EQ(info.at("height"), "2");
    EXPECT_EQ(info.at("distortion_model"), "plumb_bob");
    EXPECT_EQ(info.at("d"), Json::parse(R"(["0","0","0","0","0"])"));
    EXPECT_EQ(info.at("k"), Json::parse(R"(["594.25","0","339.5","0","591.5","242.75","0","0","1"])"));
    EXPECT_EQ(info.at("r"), Json::parse(R"(["1","0","0","0","1","0","0","0","1"])"));
    EXPECT_EQ(info.at("p"),
              Json::parse(R"(["594.25","0","339.5","0","0","591.5","242.75","0","0","0","1","0"])"));
  }
}

TEST_F(RosBag, HoldsTheFramesOfCameraAndHandleAndAgainWhenTheCameraIsMoved) {
  Bag bag = bagOf(/*depth=*/true);
  const auto& messages = bag.messages["indexed"]["/tf_static"];
  ASSERT_EQ(messages.size(), 2U);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const Json& transforms = messages[i].at("message").at("transforms");
    ASSERT_EQ(transforms.size(), 3U);
    const std::int64_t time_ns = i == 0 ? tickOf(1).planned_ns : cameraOf(2).exposure_ns;
    for (const Json& transform : transforms) {
      expectTime(messages[i], transform.at("header").at("stamp"), time_ns);
    }
    EXPECT_EQ(transforms[0].at("header").at("frame_id"), "hapticd/world");
    EXPECT_EQ(transforms[0].at("child_frame_id"), "hapticd/camera");
    expectVector(transforms[0].at("transform").at("translation"), {0.5, 0.25, i == 0 ? 1 : 1.125});
    expectQuaternion(transforms[0].at("transform").at("rotation"), {0, 0, 0, 1});
    EXPECT_EQ(transforms[1].at("header").at("frame_id"), "hapticd/camera");
    EXPECT_EQ(transforms[1].at("child_frame_id"), "hapticd/camera_optical");
    expectVector(transforms[1].at("transform").at("translation"), {});
    expectQuaternion(transforms[1].at("transform").at("rotation"), {1, 0, 0, 0});
    EXPECT_EQ(transforms[2].at("header").at("frame_id"), "hapticd/world");
    EXPECT_EQ(transforms[2].at("child_frame_id"), "hapticd/handle");
    expectVector(transforms[2].at("transform").at("translation"), {1, 2, 3});
    // half a turn about z; the cosine of a quarter turn is 0 to rounding
    const Json& rotation = transforms[2].at("transform").at("rotation");
    EXPECT_NEAR(std::abs(std::stod(rotation.at("z").get<std::string>())), 1, 1e-15);
    EXPECT_NEAR(std::stod(rotation.at("w").get<std::string>()), 0, 1e-8);
  }
}

TEST_F(RosBag, HoldsTheStretchThatIsChosen) {
  Bag bag = bagOf(/*depth=*/false, "hapticd", {.from_s = 1, .to_s = 2});
  const auto& forces = bag.messages["indexed"]["/hapticd/setpoint_cf"];
  ASSERT_EQ(forces.size(), 1001U);
  expectHeader(forces.front(), tickOf(1001).planned_ns, "hapticd/world");
  expectHeader(forces.back(), tickOf(2001).planned_ns, "hapticd/world");
  EXPECT_EQ(bag.messages["indexed"]["/hapticd/operating_state"].size(), 1U);
  EXPECT_EQ(bag.messages["indexed"]["/tf_static"].size(), 1U);
}

}  // namespace
}  // namespace hapticd::test
