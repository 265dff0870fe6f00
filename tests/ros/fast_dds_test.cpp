// SPDX-License-Identifier: Apache-2.0
// hapticd-ros and another vendor's DDS.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "rt/base/clock.h"
#include "tests/ros/fast_dds_peer.h"
#include "tests/ros/ros_listener.h"
#include "tests/ros/scene_messages.h"
#include "tests/support/program.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

TEST(FastDds, HearsTheBoxAndSeesTheUserDataOfRos2) {
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  const DaemonHome home;
  Daemon daemon(home, std::string(kWallYaml) + "control: {engage_at_start: true}\n");
  ASSERT_TRUE(daemon.answers());
  const Program bridge({HAPTICD_ROS_PROGRAM, "--socket", home.statusSocket(), "--domain",
                        std::to_string(domain), "--namespace", name_space});
  FastPeer listener(domain);
  const std::string pose_topic = "rt/" + name_space + "/measured_cp";
  dds::DataReader* const poses =
      listener.subscribe(pose_topic, "geometry_msgs::msg::dds_::PoseStamped_", /*late=*/false);
  std::size_t count = 0;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : FastPeer::take(poses)) {
      CdrBytes bytes(message);
      EXPECT_GT(bytes.number<std::int32_t>(), 1'700'000'000);
      EXPECT_LT(bytes.number<std::uint32_t>(), 1'000'000'000U);
      EXPECT_EQ(bytes.text(), name_space + "/world");
      for (int i = 0; i < 7; ++i) (void)bytes.number<double>();
      EXPECT_TRUE(bytes.ended());
      ++count;
    }
    return count >= 200;
  })) << bridge.errors();

  dds::DataReader* const states = listener.subscribe("rt/" + name_space + "/operating_state",
                                                     "crtk_msgs::msg::dds_::OperatingState_", /*late=*/true);
  std::vector<std::string> heard;
  ASSERT_TRUE(becomesTrue([&] { return !(heard = FastPeer::take(states)).empty(); })) << bridge.errors();
  EXPECT_NE(heard.back().find("ENABLED"), std::string::npos);

  const auto writer = listener.discoveries().writerOf(pose_topic);
  ASSERT_TRUE(writer);
  EXPECT_EQ(writer->type, "geometry_msgs::msg::dds_::PoseStamped_");
  EXPECT_EQ(writer->user_data,
            "typehash=RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8;");
  EXPECT_FALSE(writer->describes_its_type);
  const std::vector<std::string> participants = listener.discoveries().participants();
  EXPECT_NE(std::ranges::find(participants, "enclave=/;"), participants.end());
}

struct TopicOfBox {
  const char* name;
  const char* type;
  bool for_late;  ///< keeps its last message for those who come later
};
constexpr std::array kTopicsOfBox{
    TopicOfBox{"measured_cp", "geometry_msgs::msg::dds_::PoseStamped_", false},
    TopicOfBox{"measured_cv", "geometry_msgs::msg::dds_::TwistStamped_", false},
    TopicOfBox{"setpoint_cf", "geometry_msgs::msg::dds_::WrenchStamped_", false},
    TopicOfBox{"operating_state", "crtk_msgs::msg::dds_::OperatingState_", true},
    TopicOfBox{"buttons", "sensor_msgs::msg::dds_::Joy_", false},
    TopicOfBox{"diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_", false},
    TopicOfBox{"tf_static", "tf2_msgs::msg::dds_::TFMessage_", true}};

/// The settings with which programs of ROS 2 subscribe.
struct Subscriber {
  const char* name;
  FastPeer::Asked asked;
};
constexpr std::array kSubscribers{
    Subscriber{"rclcpp and crtk_python_client", {.reliable = true, .late = false, .depth = 10}},
    Subscriber{"sensor data", {.reliable = false, .late = false, .depth = 5}},
    Subscriber{"RViz", {.reliable = true, .late = false, .depth = 5}},
    Subscriber{"ros2 topic echo of a mixed topic", {.reliable = false, .late = false, .depth = 10}},
    Subscriber{"tf2 and ros2 topic echo of a latched topic", {.reliable = true, .late = true, .depth = 100}}};

TEST(FastDds, MatchesWhateverProgramsOfRos2AskFor) {
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  FastPeer listener(domain);  // is there first
  const Program bridge({HAPTICD_ROS_PROGRAM, "--socket", "none", "--domain", std::to_string(domain),
                        "--namespace", name_space});
  for (const TopicOfBox& topic : kTopicsOfBox) {
    const bool is_shared =
        std::string_view(topic.name) == "diagnostics" || std::string_view(topic.name) == "tf_static";
    const std::string name = "rt/" + (is_shared ? "" : name_space + "/") + topic.name;
    for (const Subscriber& subscriber : kSubscribers) {
      dds::DataReader* const reader = listener.subscribe(name, topic.type, subscriber.asked);
      if (subscriber.asked.late && !topic.for_late) {
        // matched already, had it asked for less: another reader of the topic has been
        EXPECT_FALSE(FastPeer::isMatched(reader)) << topic.name << " by " << subscriber.name;
      } else {
        EXPECT_TRUE(becomesTrue([&] { return FastPeer::isMatched(reader); }))
            << topic.name << " by " << subscriber.name << bridge.errors();
      }
    }
  }
}

TEST(FastDds, HearsWholeCloudsOfAWall) {
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  const DaemonHome home;
  Daemon daemon(home, kWallYaml);
  ASSERT_TRUE(daemon.answers());
  const Program bridge({HAPTICD_ROS_PROGRAM, "--socket", home.statusSocket(), "--domain",
                        std::to_string(domain), "--namespace", name_space, "--cloud-rate", "30"});
  FastPeer listener(domain);
  dds::DataReader* const points = listener.subscribe("rt/" + name_space + "/scene/points",
                                                     "sensor_msgs::msg::dds_::PointCloud2_", /*late=*/false);
  std::size_t count = 0;
  std::int64_t newest_ns = 0;
  std::size_t faults = 0;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : FastPeer::take(points)) {
      ++count;
      EXPECT_FALSE(message.empty()) << count;
      const CloudHeard cloud = cloudFrom(message);
      EXPECT_GT(cloud.header.time_ns, newest_ns);
      newest_ns = cloud.header.time_ns;
      EXPECT_GT(cloud.xyz_m.size(), 3U * 200'000U);
      for (std::size_t i = 2; i < cloud.xyz_m.size(); i += 3) {
        // the wall is 1 m away, and a step of the camera's raw values there is 3.1 mm
        if (std::abs(cloud.xyz_m[i] - 1) > 0.0031F) ++faults;
      }
      if (::testing::Test::HasFailure()) return true;
    }
    return count >= 50;
  })) << count
      << bridge.errors();
  EXPECT_EQ(faults, 0U);
}

/// geometry_msgs/WrenchStamped without a torque, in plain CDR, little-endian, written by hand.
std::string wrenchBytes(std::int64_t utc_ns, const std::string& frame, const rt::Vec3& force_n) {
  std::string bytes("\x00\x01\x00\x00", 4);
  const auto add = [&bytes](auto number) {
    while ((bytes.size() - 4) % sizeof number != 0) bytes += '\0';
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  add(static_cast<std::int32_t>(utc_ns / rt::kNsPerSecond));
  add(static_cast<std::uint32_t>(utc_ns % rt::kNsPerSecond));
  add(static_cast<std::uint32_t>(frame.size() + 1));
  bytes += frame;
  bytes += '\0';
  for (const double number : {force_n.x, force_n.y, force_n.z, 0.0, 0.0, 0.0}) add(number);
  return bytes;
}

TEST(FastDds, CommandsTheBox) {
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  const DaemonHome home;
  Daemon daemon(
      home,
      "safety: {handle_timeout_s: 1, depth_timeout_s: 5, overrun_burst: 65, max_external_force_n: 1}\n"
      "camera: {driver: synthetic}\n"
      "synthetic: {scene: plane, noise: off, distance_m: 2}\n"
      "simulated_handle: {start_z_m: -1, travel_m: 0.02, stroke_m: 0}\n"
      "control: {engage_at_start: true}\n");
  ASSERT_TRUE(daemon.answers());
  const Program bridge({HAPTICD_ROS_PROGRAM, "--socket", home.statusSocket(), "--control-socket",
                        home.controlSocket(), "--take", "servo_cf", "--domain", std::to_string(domain),
                        "--namespace", name_space});
  FastPeer peer(domain);
  dds::DataWriter* const forces =
      peer.advertise("rt/" + name_space + "/servo_cf", "geometry_msgs::msg::dds_::WrenchStamped_");
  const std::jthread sender([&](const std::stop_token& end) {
    while (!end.stop_requested()) {
      FastPeer::publish(forces, wrenchBytes(rt::realtimeNow_ns(), name_space + "/world", {0.25, 0, -0.5}));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    const nlohmann::json& force = status.at("tick").at("commandForceNInWorld");
    return force.at("x") == 0.25 && force.at("y") == 0 && force.at("z") == -0.5;
  })) << bridge.errors();
}

}  // namespace
}  // namespace hapticd::test
