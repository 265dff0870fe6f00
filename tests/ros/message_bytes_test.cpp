// SPDX-License-Identifier: Apache-2.0
// What goes over the wire, byte by byte, and member by member as an independent decoder reads it by the
// definitions.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "ros_messages.h"
#include "tests/ros/ros_listener.h"
#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticd-ros/dds/publications.h"
#include "tools/hapticd-ros/scene/scene_topics.h"
#include "tools/lib/ros/message_definitions.h"

namespace hapticd::test {
namespace {

using Json = nlohmann::json;
using tools::ros::Publications;

constexpr std::int64_t kTime_ns = 1'000'000'002;
/// The encoding, the time 1 s 2 ns, and the frame "base".
const std::string kHeader =
    "00010000"
    "01000000"
    "02000000"
    "05000000"
    "6261736500";

/// Publications and a listener in one process.
class MessageBytes : public ::testing::Test {
 protected:
  MessageBytes() {
    auto joined = tools::ros::Participant::join({.domain = domain_, .interface = ""});
    if (!joined) {
      ADD_FAILURE() << joined.error().text();
      return;
    }
    participant_.emplace(*joined);
    auto scene = tools::ros::SceneTopics::open(*participant_, "hapticd");
    if (!scene) {
      ADD_FAILURE() << scene.error().text();
      return;
    }
    scene_.emplace(std::move(*scene));
    auto opened = Publications::open(*participant_, "hapticd", "base");
    if (!opened) {
      ADD_FAILURE() << opened.error().text();
      return;
    }
    publications_.emplace(std::move(*opened));
    listener_.emplace(domain_);
  }
  void SetUp() override { ASSERT_TRUE(listener_); }

  Publications& publications() { return *publications_; }
  tools::ros::SceneTopics& scene() { return *scene_; }

  /// Listens to a topic, publishes by `publish`, and returns the one message that came.
  std::string bytesOf(const std::string& topic, const dds_topic_descriptor_t& type, auto publish) {
    listener_->subscribe(topic, type);
    EXPECT_TRUE(becomesTrue([&] { return listener_->isMatched(topic); })) << topic;
    publish();
    std::vector<std::string> messages;
    EXPECT_TRUE(becomesTrue([&] { return !(messages = listener_->take(topic)).empty(); })) << topic;
    return messages.empty() ? "" : messages.front();
  }

  int domain_ = ownDomain();
  std::optional<tools::ros::Participant> participant_;
  std::optional<tools::ros::SceneTopics> scene_;
  std::optional<Publications> publications_;
  std::optional<RosListener> listener_;  // after it: the domain is that of the publications
};

TEST_F(MessageBytes, OfAPoseAreThoseOfRos2) {
  const std::string bytes = bytesOf("rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc, [&] {
    publications().measuredPose(kTime_ns, {{0.1, 0.2, 0.3}, {0, 0, 0, 1}});
  });
  EXPECT_EQ(hexOf(bytes), kHeader + std::string(14, '0') +
                              "9a9999999999b93f"
                              "9a9999999999c93f"
                              "333333333333d33f" +
                              std::string(48, '0') + "000000000000f03f");
}

TEST_F(MessageBytes, OfAForceAreThoseOfRos2) {
  const std::string bytes =
      bytesOf("rt/hapticd/setpoint_cf", geometry_msgs_msg_dds__WrenchStamped__desc, [&] {
        publications().setpointForce(kTime_ns, {1, 2, 3});
      });
  EXPECT_EQ(hexOf(bytes), kHeader + std::string(14, '0') +
                              "000000000000f03f"
                              "0000000000000040"
                              "0000000000000840" +
                              std::string(48, '0'));
}

Json vectorJson(double x, double y, double z) {
  return {{"x", x}, {"y", y}, {"z", z}};
}
Json quaternionJson(const rt::Quaternion& q) {
  return {{"x", q.x}, {"y", q.y}, {"z", q.z}, {"w", q.w}};
}
Json headerJson(const std::string& frame) {
  return {{"stamp", {{"sec", 1}, {"nanosec", 2}}}, {"frame_id", frame}};
}

/// RTPS fills messages up to whole words, and says by how many bytes in the last two bits of the encoding;
/// the decoder's own encoder does neither.
std::string withoutPadding(std::string bytes) {
  const auto padding = static_cast<std::size_t>(bytes.at(3) & 3);
  bytes.resize(bytes.size() - padding);
  bytes[3] = 0;
  return bytes;
}

/// Decodes messages by their definitions in another program, and compares what they mean.
class Decoder {
 public:
  void expect(const std::string& name, const std::string& bytes, const Json& meaning) {
    lines_ +=
        Json{{"definition", tools::ros::completeDefinition(name)}, {"bytes", hexOf(bytes)}}.dump() + "\n";
    expected_.push_back({{"message", meaning}, {"bytes", hexOf(withoutPadding(bytes))}});
  }
  void compare() {
    const TemporaryFolder folder;
    const Finished decoded =
        runToEnd({NODE_PROGRAM, DECODE_MESSAGES, folder.write("messages", lines_).string()});
    ASSERT_EQ(decoded.ending, exitedWith(0)) << decoded.errors;
    std::istringstream output(decoded.output);
    std::size_t count = 0;
    for (std::string line; std::getline(output, line); ++count)
      EXPECT_EQ(Json::parse(line), expected_.at(count)) << count;
    EXPECT_EQ(count, expected_.size());
  }

 private:
  std::string lines_;
  std::vector<Json> expected_;
};

/// As bytesOf(), of a message that hapticd-ros does not publish.
std::string bytesOfSample(int domain, const dds_topic_descriptor_t& type, const void* sample) {
  RosListener listener(domain);
  listener.subscribe("rt/sample", type);
  const dds_entity_t participant =
      dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  const dds_entity_t topic = dds_create_topic(participant, &type, "rt/sample", nullptr, nullptr);
  const dds_entity_t writer = dds_create_writer(participant, topic, nullptr, nullptr);
  EXPECT_TRUE(becomesTrue([&] { return listener.isMatched("rt/sample"); }));
  EXPECT_EQ(dds_write(writer, sample), DDS_RETCODE_OK);
  std::vector<std::string> messages;
  EXPECT_TRUE(becomesTrue([&] { return !(messages = listener.take("rt/sample")).empty(); }));
  dds_delete(participant);
  return messages.empty() ? "" : messages.front();
}

TEST_F(MessageBytes, MeanInEachMemberWhatWasPublished) {
  if (std::filesystem::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  Decoder decoder;
  const rt::Quaternion turned{0.5, -0.5, 0.5, -0.5};
  decoder.expect(
      "geometry_msgs/PoseStamped",
      bytesOf("rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc,
              [&] {
                publications().measuredPose(kTime_ns, {{1.25, -2.5, 3.75}, turned});
              }),
      {{"header", headerJson("base")},
       {"pose", {{"position", vectorJson(1.25, -2.5, 3.75)}, {"orientation", quaternionJson(turned)}}}});
  decoder.expect("geometry_msgs/TwistStamped",
                 bytesOf("rt/hapticd/measured_cv", geometry_msgs_msg_dds__TwistStamped__desc,
                         [&] {
                           publications().measuredVelocity(kTime_ns, {4, 5, 6});
                         }),
                 {{"header", headerJson("base")},
                  {"twist", {{"linear", vectorJson(4, 5, 6)}, {"angular", vectorJson(0, 0, 0)}}}});
  decoder.expect("geometry_msgs/WrenchStamped",
                 bytesOf("rt/hapticd/setpoint_cf", geometry_msgs_msg_dds__WrenchStamped__desc,
                         [&] {
                           publications().setpointForce(kTime_ns, {7, 8, 9});
                         }),
                 {{"header", headerJson("base")},
                  {"wrench", {{"force", vectorJson(7, 8, 9)}, {"torque", vectorJson(0, 0, 0)}}}});
  decoder.expect(
      "crtk_msgs/OperatingState",
      bytesOf("rt/hapticd/operating_state", crtk_msgs_msg_dds__OperatingState__desc,
              [&] { publications().operatingState(kTime_ns, "ENABLED", true, false); }),
      {{"header", headerJson("base")}, {"state", "ENABLED"}, {"is_homed", true}, {"is_busy", false}});
  std::vector<float> axes{0.5F, -1.5F};
  std::vector<std::int32_t> held{1, 0, 1};
  decoder.expect("sensor_msgs/Joy",
                 bytesOf("rt/hapticd/buttons", sensor_msgs_msg_dds__Joy__desc,
                         [&] { publications().buttons(kTime_ns, axes, held); }),
                 {{"header", headerJson("base")}, {"axes", axes}, {"buttons", held}});
  const std::vector<tools::ros::Diagnostic> parts{
      {tools::ros::Diagnostic::Level::error, "a", "bc", "def", {{"k", "v"}, {"key", ""}}},
      {tools::ros::Diagnostic::Level::ok, "second", "", "", {}}};
  decoder.expect("diagnostic_msgs/DiagnosticArray",
                 bytesOf("rt/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc,
                         [&] { publications().diagnostics(kTime_ns, parts); }),
                 {{"header", headerJson("")},
                  {"status",
                   {{{"level", 2},
                     {"name", "a"},
                     {"message", "bc"},
                     {"hardware_id", "def"},
                     {"values", {{{"key", "k"}, {"value", "v"}}, {{"key", "key"}, {"value", ""}}}}},
                    {{"level", 0},
                     {"name", "second"},
                     {"message", ""},
                     {"hardware_id", ""},
                     {"values", Json::array()}}}}});
  const std::vector<tools::ros::FixedFrame> frames{{"world", "camera", {{1, 2, 3}, turned}},
                                                   {"world", "odd", {{4, 5, 6}, {}}}};
  const auto transformJson = [](const char* name, const Json& translation, const rt::Quaternion& rotation) {
    return Json{{"header", headerJson("world")},
                {"child_frame_id", name},
                {"transform", {{"translation", translation}, {"rotation", quaternionJson(rotation)}}}};
  };
  decoder.expect("tf2_msgs/TFMessage",
                 bytesOf("rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc,
                         [&] { publications().fixedFrames(kTime_ns, frames); }),
                 {{"transforms",
                   {transformJson("camera", vectorJson(1, 2, 3), turned),
                    transformJson("odd", vectorJson(4, 5, 6), {})}}});
  std::string frame = "base", command = "enable";
  const crtk_msgs_msg_dds__StringStamped_ sample{{{1, 2}, frame.data()}, command.data()};
  decoder.expect("crtk_msgs/StringStamped",
                 bytesOfSample(domain_, crtk_msgs_msg_dds__StringStamped__desc, &sample),
                 {{"header", headerJson("base")}, {"string", "enable"}});
  const std_msgs_msg_dds__Bool_ yes{true};
  decoder.expect("std_msgs/Bool", bytesOfSample(domain_, std_msgs_msg_dds__Bool__desc, &yes),
                 {{"data", true}});
  std::string joint = "gripper";
  std::vector<char*> joints{joint.data()};
  std::vector<double> opening{0.25, 0.5}, speed{-1.5};
  const sensor_msgs_msg_dds__JointState_ joint_sample{{{1, 2}, frame.data()},
                                                      {1, 1, joints.data(), false},
                                                      {2, 2, opening.data(), false},
                                                      {1, 1, speed.data(), false},
                                                      {}};
  decoder.expect("sensor_msgs/JointState",
                 bytesOfSample(domain_, sensor_msgs_msg_dds__JointState__desc, &joint_sample),
                 {{"header", headerJson("base")},
                  {"name", {"gripper"}},
                  {"position", opening},
                  {"velocity", speed},
                  {"effort", Json::array()}});
  decoder.compare();
}

/// The bytes of numbers, as the decoder prints lists of them.
template <typename Number>
Json bytesJson(const std::vector<Number>& numbers) {
  const auto bytes = std::as_bytes(std::span(numbers));
  Json list = Json::array();
  for (const std::byte byte : bytes) list.push_back(std::to_integer<int>(byte));
  return list;
}

TEST_F(MessageBytes, OfTheSceneMeanInEachMemberWhatWasPublished) {
  if (std::filesystem::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  Decoder decoder;
  const std::vector<float> xyz_m{0.5F, -1.5F, 2.5F, 3, 4, 5.25F};
  const auto fieldJson = [](const char* name, int offset) {
    return Json{{"name", name}, {"offset", offset}, {"datatype", 7}, {"count", 1}};
  };
  decoder.expect("sensor_msgs/PointCloud2",
                 bytesOf("rt/hapticd/scene/points", sensor_msgs_msg_dds__PointCloud2__desc,
                         [&] { EXPECT_TRUE(scene().points(kTime_ns, xyz_m)); }),
                 {{"header", headerJson("hapticd/camera_optical")},
                  {"height", 1},
                  {"width", 2},
                  {"fields", {fieldJson("x", 0), fieldJson("y", 4), fieldJson("z", 8)}},
                  {"is_bigendian", false},
                  {"point_step", 12},
                  {"row_step", 24},
                  {"data", bytesJson(xyz_m)},
                  {"is_dense", true}});
  const tools::ros::DepthImage image{.width_px = 3, .height_px = 2, .depth_mm = {0, 1, 258, 1000, 65535, 7}};
  decoder.expect("sensor_msgs/Image",
                 bytesOf("rt/hapticd/depth/image_raw", sensor_msgs_msg_dds__Image__desc,
                         [&] { EXPECT_TRUE(scene().image(kTime_ns, image)); }),
                 {{"header", headerJson("hapticd/camera_optical")},
                  {"height", 2},
                  {"width", 3},
                  {"encoding", "16UC1"},
                  {"is_bigendian", 0},
                  {"step", 6},
                  {"data", bytesJson(image.depth_mm)}});
  const tools::ros::PinholeCamera camera{640, 480, 594.5, 591.25, 339.5, 242.75};
  decoder.expect(
      "sensor_msgs/CameraInfo",
      bytesOf("rt/hapticd/depth/camera_info", sensor_msgs_msg_dds__CameraInfo__desc,
              [&] { EXPECT_TRUE(scene().cameraInfo(kTime_ns, camera)); }),
      {{"header", headerJson("hapticd/camera_optical")},
       {"height", 480},
       {"width", 640},
       {"distortion_model", "plumb_bob"},
       {"d", {0, 0, 0, 0, 0}},
       {"k", {594.5, 0, 339.5, 0, 591.25, 242.75, 0, 0, 1}},
       {"r", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
       {"p", {594.5, 0, 339.5, 0, 0, 591.25, 242.75, 0, 0, 0, 1, 0}},
       {"binning_x", 0},
       {"binning_y", 0},
       {"roi", {{"x_offset", 0}, {"y_offset", 0}, {"height", 0}, {"width", 0}, {"do_rectify", false}}}});
  decoder.compare();
}

/// visualization_msgs/Marker as hapticd-ros leaves it where there is nothing to say.
Json emptyMarkerJson() {
  return {{"header", headerJson("hapticd/world")},
          {"ns", ""},
          {"id", 0},
          {"type", 0},
          {"action", 0},
          {"pose", {{"position", vectorJson(0, 0, 0)}, {"orientation", quaternionJson({})}}},
          {"scale", vectorJson(0, 0, 0)},
          {"color", {{"r", 0}, {"g", 0}, {"b", 0}, {"a", 0}}},
          {"lifetime", {{"sec", 0}, {"nanosec", 0}}},
          {"frame_locked", false},
          {"points", Json::array()},
          {"colors", Json::array()},
          {"texture_resource", ""},
          {"texture",
           {{"header", {{"stamp", {{"sec", 0}, {"nanosec", 0}}}, {"frame_id", ""}}},
            {"format", ""},
            {"data", Json::array()}}},
          {"uv_coordinates", Json::array()},
          {"text", ""},
          {"mesh_resource", ""},
          {"mesh_file", {{"filename", ""}, {"data", Json::array()}}},
          {"mesh_use_embedded_materials", false}};
}

TEST_F(MessageBytes, OfMarkersMeanInEachMemberWhatWasPublished) {
  if (std::filesystem::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  const rt::Quaternion turned{0.5, -0.5, 0.5, -0.5};
  const tools::ros::Marker path{.name = "way",
                                .id = 7,
                                .kind = tools::ros::Marker::Kind::line_strip,
                                .T_frame_marker = {{1, 2, 3}, turned},
                                .scale_m = {0.5, 0.25, 0.125},
                                .colour = {0.25F, 0.5F, 0.75F, 1},
                                .points_m = {{4, 5, 6}, {7, 8, 9}},
                                .text = "words"};
  Json all = emptyMarkerJson();
  all["action"] = 3;
  Json one = emptyMarkerJson();
  one.update({{"ns", "way"},
              {"id", 7},
              {"type", 4},
              {"pose", {{"position", vectorJson(1, 2, 3)}, {"orientation", quaternionJson(turned)}}},
              {"scale", vectorJson(0.5, 0.25, 0.125)},
              {"color", {{"r", 0.25}, {"g", 0.5}, {"b", 0.75}, {"a", 1}}},
              {"points", {vectorJson(4, 5, 6), vectorJson(7, 8, 9)}},
              {"text", "words"}});
  Decoder decoder;
  decoder.expect("visualization_msgs/MarkerArray",
                 bytesOf("rt/hapticd/fixtures", visualization_msgs_msg_dds__MarkerArray__desc,
                         [&] { EXPECT_TRUE(scene().fixtures(kTime_ns, std::span(&path, 1))); }),
                 {{"markers", {all, one}}});
  decoder.compare();
}

}  // namespace
}  // namespace hapticd::test
