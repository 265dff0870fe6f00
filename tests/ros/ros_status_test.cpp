// SPDX-License-Identifier: Apache-2.0
// `hapticctl ros`: what is published and taken, by whom, and what does not match.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tests/ros/box_on_the_wire.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

class RosStatus : public BoxOnTheWire {
 protected:
  void startBridgeWithStatus(const std::vector<std::string>& more = {}) {
    std::vector<std::string> all{"--status-file", file_};
    all.insert(all.end(), more.begin(), more.end());
    startBridge(all);
  }
  Finished shown(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"ros", "--file", file_};
    words.insert(words.end(), more.begin(), more.end());
    return home_.control(words);
  }
  bool shows(const std::string& text) const {
    return becomesTrue([&] { return shown().output.contains(text); }, std::chrono::milliseconds(100));
  }
  /// The entry of a topic below "published" or "taken"; null: none.
  json topicShown(const char* list, const std::string& name) const {
    const json status = json::parse(shown({"--json"}).output, nullptr, false);
    if (!status.is_object()) return {};
    for (const json& entry : status.at(list)) {
      if (entry.at("topic") == name) return entry;
    }
    return {};
  }
  std::string ros(const std::string& name) const { return "/" + namespace_ + "/" + name; }

  std::string file_ = (home_.path() / "ros.json").string();
};

TEST_F(RosStatus, ShowsRatesSubscribersAndSettingsThatDoNotMatch) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeWithStatus();
  listener_.subscribe(topic("measured_cp"), geometry_msgs_msg_dds__PoseStamped__desc);
  listener_.subscribe(topic("setpoint_cf"), geometry_msgs_msg_dds__WrenchStamped__desc, /*late=*/true);
  ASSERT_TRUE(shows("! " + ros("setpoint_cf") + " does not reach")) << shown().output << shown().errors;
  EXPECT_TRUE(shows("hapticd is engaged"));
  const std::string text = shown().output;
  EXPECT_TRUE(text.contains("durability: volatile is offered, transient local is requested")) << text;
  EXPECT_TRUE(text.contains(fmt::format("publishes /{}/... in domain {} at lo", namespace_, domain_)))
      << text;
  EXPECT_TRUE(text.contains("Nothing is taken from the network")) << text;

  ASSERT_TRUE(becomesTrue([&] { return topicShown("published", ros("measured_cp")).at("rateHz") > 0; }));
  const json pose = topicShown("published", ros("measured_cp"));
  EXPECT_EQ(pose.at("type"), "geometry_msgs/msg/PoseStamped");
  ASSERT_EQ(pose.at("subscribers").size(), 1U);
  EXPECT_EQ(pose.at("subscribers")[0].at("problem"), nullptr);
  EXPECT_EQ(pose.at("failed"), 0);
  // the process of this test
  EXPECT_TRUE(pose.at("subscribers")[0].at("name").get<std::string>().contains(
      fmt::format("(process {} of ", ::getpid())))
      << pose;

  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0));
  EXPECT_FALSE(std::filesystem::exists(file_));
  EXPECT_EQ(shown().ending, exitedWith(1));
  EXPECT_TRUE(shown().errors.contains("is hapticd-ros running?")) << shown().errors;
}

TEST_F(RosStatus, ShowsTheNodeOfAProgramThatAnnouncesOneAndIsItselfANode) {
  startBridgeWithStatus();
  listener_.subscribe("ros_discovery_info", rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, true);
  std::string announced;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : listener_.take("ros_discovery_info")) announced = message;
    return !announced.empty();
  }));
  CdrBytes bytes(announced);
  for (int i = 0; i < 16; ++i) (void)bytes.number<std::uint8_t>();
  EXPECT_EQ(bytes.number<std::uint32_t>(), 1U);
  EXPECT_EQ(bytes.text(), "/" + namespace_);
  EXPECT_EQ(bytes.text(), "hapticd_ros");
  EXPECT_EQ(bytes.number<std::uint32_t>(), 0U);  // readers
  EXPECT_GE(bytes.number<std::uint32_t>(), 7U);  // writers

  // as a program of ROS 2 with a node of one publisher does
  startBridgeWithStatus({"--take", "servo_cf", "--control-socket", home_.controlSocket()});
  RosTalker talker(domain_);
  talker.advertise(topic("servo_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  talker.announce("/lab", "controller");
  EXPECT_TRUE(becomesTrue([&] {
    const json entry = topicShown("taken", ros("servo_cf"));
    return entry.is_object() && entry.at("publishers").size() == 1 &&
           entry.at("publishers")[0].at("name") == "/lab/controller";
  })) << shown().output;
}

TEST_F(RosStatus, ShowsWhatIsRefusedAndPublishersThatDoNotMatch) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeWithStatus(
      {"--take", "servo_cf", "--take", "state_command", "--control-socket", home_.controlSocket()});
  RosTalker talker(domain_);
  talker.advertise(topic("servo_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  talker.advertise(topic("state_command"), crtk_msgs_msg_dds__StringStamped__desc, /*reliable=*/false);
  ASSERT_TRUE(becomesTrue([&] { return talker.isMatched(topic("servo_cf")); }));
  std::string frame = "elsewhere";
  const geometry_msgs_msg_dds__WrenchStamped_ force{{{0, 0}, frame.data()}, {{0, 0, 1}, {}}};
  EXPECT_TRUE(becomesTrue(
      [&] {
        talker.publish(topic("servo_cf"), &force);
        return shown().output.contains("messages were refused");
      },
      std::chrono::milliseconds(100)))
      << shown().output;
  const json entry = topicShown("taken", ros("servo_cf"));
  EXPECT_GT(entry.at("refused"), 0);
  EXPECT_EQ(entry.at("taken"), 0);
  EXPECT_TRUE(entry.at("lastRefusal").get<std::string>().contains("frame_id")) << entry;
  EXPECT_TRUE(shows("! " + ros("state_command") + " does not come from")) << shown().output;
  EXPECT_TRUE(shown().output.contains("reliability: best effort is offered, reliable is requested"))
      << shown().output;
}

TEST_F(RosStatus, WarnsOfASecondBridgeWithTheSameNames) {
  startBridgeWithStatus();
  const Program second({HAPTICD_ROS_PROGRAM, "--domain", std::to_string(domain_), "--namespace", namespace_,
                        "--socket", "none"});
  EXPECT_TRUE(shows("! " + ros("measured_cp") + " is published by /" + namespace_ + "/hapticd_ros, too"))
      << shown().output;
  EXPECT_FALSE(shown().output.contains("! /diagnostics")) << shown().output;
}

TEST_F(RosStatus, SaysThatAFileIsOldOrSomethingElse) {
  const auto refused = [&](const std::string& content) {
    home_.write("ros.json", content);
    const Finished finished = shown();
    EXPECT_EQ(finished.ending, exitedWith(1)) << content;
    return finished.errors;
  };
  const std::int64_t then_ns = rt::realtimeNow_ns() - 3600 * rt::kNsPerSecond;
  EXPECT_TRUE(refused(fmt::format(R"({{"writtenUtcNs": {}, "published": []}})", then_ns))
                  .contains("is 60 min old: hapticd-ros has been killed, or hangs"));
  for (const char* const content : {"", "{", "[]", "null", R"({"published": 3})", R"({"writtenUtcNs": 1})"})
    EXPECT_FALSE(refused(content).empty()) << content;
  // a file of another version: what is missing or of another type is shown as "-"
  home_.write("ros.json",
              fmt::format(R"({{"writtenUtcNs": {}, "published": [1, {{"topic": "/a", "rateHz": "b",
      "subscribers": [{{}}, 2]}}], "taken": 5}})",
                          rt::realtimeNow_ns()));
  EXPECT_EQ(shown().ending, exitedWith(0)) << shown().errors;
  EXPECT_TRUE(shown().output.contains("/a")) << shown().output;
}

TEST_F(RosStatus, IsNotWrittenWhereThatIsNotPossibleAndTheRestGoesOn) {
  file_ = "/nowhere/ros.json";
  startBridgeWithStatus();
  EXPECT_TRUE(says("/nowhere/ros.json"));
  listenToState();
  EXPECT_TRUE(stateBecomes("DISABLED"));
  std::this_thread::sleep_for(std::chrono::seconds(3));  // three further attempts
  EXPECT_EQ(timesSaid("/nowhere/ros.json"), 1U);
}

}  // namespace
}  // namespace hapticd::test
