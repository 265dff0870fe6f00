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

}  // namespace
}  // namespace hapticd::test
