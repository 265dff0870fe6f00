// SPDX-License-Identifier: Apache-2.0
// hapticd, hapticd-ros and a program of DDS that listens, each as a process of its own.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "rt/base/vec3.h"
#include "tests/ros/box_on_the_wire.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::test {
namespace {

TEST_F(BoxOnTheWire, IsAnnouncedAsRos2ExpectsIt) {
  startBridge();
  const std::map<std::string, std::pair<std::string, std::string>> expected{
      {topic("measured_cp"),
       {"geometry_msgs::msg::dds_::PoseStamped_",
        "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"}},
      {topic("measured_cv"),
       {"geometry_msgs::msg::dds_::TwistStamped_",
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"}},
      {topic("setpoint_cf"),
       {"geometry_msgs::msg::dds_::WrenchStamped_",
        "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"}},
      {topic("operating_state"),
       {"crtk_msgs::msg::dds_::OperatingState_",
        "5cc57eea589b217fe5194bf2735b91d4a7f2dd5ac1245ae657f7ea7590c2c80e"}},
      {topic("buttons"),
       {"sensor_msgs::msg::dds_::Joy_", "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5"}},
      {"rt/diagnostics",
       {"diagnostic_msgs::msg::dds_::DiagnosticArray_",
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"}},
      {"rt/tf_static",
       {"tf2_msgs::msg::dds_::TFMessage_",
        "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"}}};
  const std::set<std::string> for_late{topic("operating_state"), "rt/tf_static"};
  for (const auto& [name, type] : expected) {
    std::optional<WriterSeen> seen;
    ASSERT_TRUE(becomesTrue([&] { return (seen = listener_.writerOf(name)).has_value(); }))
        << name << bridge_->errors();
    EXPECT_EQ(seen->type, type.first);
    EXPECT_EQ(seen->user_data, "typehash=RIHS01_" + type.second + ";");
    EXPECT_EQ(seen->participant_user_data, "enclave=/;");
    EXPECT_TRUE(seen->reliable) << name;
    EXPECT_EQ(seen->transient_local, for_late.contains(name)) << name;
    // plain CDR alone, or none named, which means that
    for (const int representation : seen->representations) EXPECT_EQ(representation, 0) << name;
  }
}

/// The numbers of messages, or of what they were made of, by time: CLOCK_MONOTONIC of hapticd's own, UTC of
/// what was heard.
using Timed = std::map<std::int64_t, std::vector<double>>;

/// What hapticd itself says of its ticks.
class OwnTicks {
 public:
  explicit OwnTicks(const std::string& socket) : client_(*tools::VarlinkClient::connect(socket)) {
    EXPECT_TRUE(client_.subscribe("io.hapticd.Status.Ticks",
                                  {{"fields",
                                    {"planned_ns", "command_force_n_in_world", "handle_time_ns",
                                     "handle_position_m_in_world", "handle_velocity_m_per_s_in_world",
                                     "handle_orientation_in_world_x", "handle_orientation_in_world_y",
                                     "handle_orientation_in_world_z", "handle_orientation_in_world_w"}},
                                   {"intervalMs", 5}}));
  }
  void takeBatch() {
    const auto reply = client_.next(std::chrono::seconds(10));
    ASSERT_TRUE(reply) << reply.error().what;
    const auto& ticks = (*reply)["ticks"];
    for (std::size_t i = 0; i < (*reply)["count"].get<std::size_t>(); ++i) {
      const auto numbers = [&](const char* field) { return ticks[field][i].get<std::vector<double>>(); };
      newest_ns_ = ticks["planned_ns"][i].get<std::int64_t>();
      const auto measured_ns = ticks["handle_time_ns"][i].get<std::int64_t>();
      std::vector<double> pose = numbers("handle_position_m_in_world");
      for (const char* part : {"x", "y", "z", "w"})
        pose.push_back(ticks[std::string("handle_orientation_in_world_") + part][i].get<double>());
      // no torque is exerted, and no angular velocity measured
      const auto withZeros = [](std::vector<double> three) {
        three.resize(6);
        return three;
      };
      all_["measured_cp"][measured_ns] = pose;
      all_["measured_cv"][measured_ns] = withZeros(numbers("handle_velocity_m_per_s_in_world"));
      all_["setpoint_cf"][newest_ns_] = withZeros(numbers("command_force_n_in_world"));
    }
  }
  std::int64_t newest_ns() const { return newest_ns_; }

  /// Whether a message of that topic has been made of one of them: with all numbers bit by bit, and its time
  /// within 0.1 s: both hapticd-ros and the test measure the offset between the clocks, and may be
  /// interrupted meanwhile.
  bool hold(const std::string& name, std::int64_t utc_ns, const std::vector<double>& numbers) const {
    const std::int64_t monotonic_ns = utc_ns - (rt::realtimeNow_ns() - rt::monotonicNow_ns());
    constexpr std::int64_t kTolerance_ns = 100'000'000;
    const Timed& all = all_.at(name);
    for (auto one = all.lower_bound(monotonic_ns - kTolerance_ns);
         one != all.end() && one->first < monotonic_ns + kTolerance_ns; ++one) {
      if (one->second == numbers) return true;
    }
    return false;
  }

 private:
  tools::VarlinkClient client_;
  std::int64_t newest_ns_ = 0;
  std::map<std::string, Timed> all_;  ///< by topic
};

TEST_F(BoxOnTheWire, IsPublishedAsHapticdItselfReportsIt) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  OwnTicks own(home_.statusSocket());
  own.takeBatch();  // the first is empty: from here on it holds all
  startBridge();
  const std::map<std::string, std::pair<const dds_topic_descriptor_t*, std::size_t>> kinds{
      {"measured_cp", {&geometry_msgs_msg_dds__PoseStamped__desc, 7}},
      {"measured_cv", {&geometry_msgs_msg_dds__TwistStamped__desc, 6}},
      {"setpoint_cf", {&geometry_msgs_msg_dds__WrenchStamped__desc, 6}}};
  for (const auto& [name, kind] : kinds) listener_.subscribe(topic(name), *kind.first);

  std::map<std::string, Timed> heard;
  bool pressed = false;
  const auto takeAll = [&] {
    for (const auto& [name, kind] : kinds) {
      for (const std::string& message : listener_.take(topic(name))) {
        CdrBytes bytes(message);
        const Header header = headerFrom(bytes);
        EXPECT_EQ(header.frame, namespace_ + "/world");
        std::vector<double> numbers;
        while (numbers.size() < kind.second) numbers.push_back(bytes.number<double>());
        EXPECT_TRUE(bytes.ended());
        EXPECT_TRUE(heard[name].empty() || heard[name].rbegin()->first < header.time_ns) << name;
        heard[name][header.time_ns] = numbers;
        pressed = pressed || (name == "setpoint_cf" && numbers[2] != 0);
      }
    }
    return pressed && heard["measured_cp"].size() >= 300 && heard["measured_cv"].size() >= 300;
  };
  ASSERT_TRUE(becomesTrue([&] {
    own.takeBatch();
    return takeAll();
  })) << bridge_->errors();
  for (const std::int64_t until_ns = rt::monotonicNow_ns(); own.newest_ns() < until_ns;) own.takeBatch();
  for (const auto& [name, messages] : heard) {
    for (const auto& [utc_ns, numbers] : messages)
      EXPECT_TRUE(own.hold(name, utc_ns, numbers)) << name << " " << utc_ns;
  }
}

TEST_F(BoxOnTheWire, TellsLateListenersItsStateAndItsFrames) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge();
  listenToState();
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  EXPECT_TRUE(state_.is_homed);
  EXPECT_FALSE(state_.is_busy);

  listener_.subscribe("rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, /*late=*/true);
  std::map<std::string, std::string> parents;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : listener_.take("rt/tf_static")) {
      for (const auto& [name, frame] : framesFrom(message)) parents[name] = frame.first;
    }
    return parents.contains(namespace_ + "/handle");
  }));
  EXPECT_EQ(parents,
            (std::map<std::string, std::string>{{namespace_ + "/camera", namespace_ + "/world"},
                                                {namespace_ + "/camera_optical", namespace_ + "/camera"},
                                                {namespace_ + "/handle", namespace_ + "/world"}}));

  listener_.subscribe("rt/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc);
  bool reported = false;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : listener_.take("rt/diagnostics"))
      reported = reported || message.find(namespace_ + ": force loop") != message.npos;
    return reported;
  }));
  listener_.subscribe(topic("buttons"), sensor_msgs_msg_dds__Joy__desc);
  EXPECT_TRUE(hears("buttons"));

  const Finished disengaged = home_.control({"disengage"});
  EXPECT_EQ(disengaged.ending, exitedWith(0)) << disengaged.errors;
  EXPECT_TRUE(stateBecomes("DISABLED"));
}

TEST_F(BoxOnTheWire, OutlivesADaemonThatIsKilledAndFindsItAgain) {
  startBridge();
  listenToState();
  listener_.subscribe(topic("setpoint_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  ASSERT_TRUE(stateBecomes("DISABLED"));
  ASSERT_TRUE(says("waiting for hapticd"));
  std::optional<Daemon> daemon(std::in_place, home_, kEngagedYaml);
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  ASSERT_TRUE(hears("setpoint_cf"));

  daemon->signal(SIGKILL);
  (void)daemon->wait();
  ASSERT_TRUE(stateBecomes("DISABLED"));
  EXPECT_FALSE(state_.is_homed);
  daemon.emplace(home_, kEngagedYaml);
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  (void)listener_.take(topic("setpoint_cf"));
  EXPECT_TRUE(hears("setpoint_cf"));
  EXPECT_EQ(timesSaid("waiting for hapticd"), 2U) << bridge_->errors();

  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
}

TEST_F(BoxOnTheWire, GoesOnWhenTheBridgeIsKilledAndIsThereWithANewOne) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge();
  listener_.subscribe(topic("measured_cp"), geometry_msgs_msg_dds__PoseStamped__desc);
  ASSERT_TRUE(hears("measured_cp")) << bridge_->errors();
  bridge_->signal(SIGKILL);
  (void)bridge_->wait();
  EXPECT_TRUE(daemon.ticks());
  startBridge();
  (void)listener_.take(topic("measured_cp"));
  EXPECT_TRUE(hears("measured_cp")) << bridge_->errors();
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(BoxOnTheWire, ReachesTheOthersWhenOneListenerHangs) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridge({"--rate", "1000"});
  Program deaf({DEAF_LISTENER, std::to_string(domain_), topic("setpoint_cf")});
  ASSERT_TRUE(becomesTrue([&] { return deaf.output().contains("hears"); })) << bridge_->errors();
  deaf.signal(SIGSTOP);
  listener_.subscribe(topic("setpoint_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  std::size_t count = 0;
  // hundreds of times what a writer keeps for a reader that is late
  EXPECT_TRUE(becomesTrue([&] { return (count += listener_.take(topic("setpoint_cf")).size()) > 3000; }))
      << count;
  EXPECT_EQ(timesSaid("could not be written"), 0U) << bridge_->errors();
  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
}

TEST_F(BoxOnTheWire, TakesANamespaceWithASlashInFrontAsRos2WritesIt) {
  bridge_.emplace(std::vector<std::string>{HAPTICD_ROS_PROGRAM, "--socket", home_.statusSocket(), "--domain",
                                           std::to_string(domain_), "--namespace", "/" + namespace_});
  EXPECT_TRUE(becomesTrue([&] { return bridge_->output().contains("publishes /" + namespace_ + "/..."); }))
      << bridge_->output();
  EXPECT_TRUE(becomesTrue([&] { return listener_.writerOf(topic("measured_cp")).has_value(); }));
}

TEST_F(BoxOnTheWire, SaysWhichInterfaceThereIsNot) {
  startBridge({"--interface", "nowhere0"});
  EXPECT_EQ(bridge_->wait(), exitedWith(69));
  EXPECT_TRUE(contains(bridge_->errors(), "--interface: \"nowhere0\" has no IPv4 address here"));
  EXPECT_TRUE(contains(bridge_->errors(), "lo 127.0.0.1"));
}

TEST_F(BoxOnTheWire, WarnsWhereOthersCanReachIt) {
  startBridge({"--interface", "127.0.0.1"});
  EXPECT_TRUE(says("DDS asks nobody who they are"));
}

}  // namespace
}  // namespace hapticd::test
