// SPDX-License-Identifier: Apache-2.0
// Programs in the network command hapticd through hapticd-ros, each as a process of its own.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tests/ros/box_on_the_wire.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

/// The hand is 1 m before the wall, and so without a force of the box; forces of others are allowed.
const std::string kFreeYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, overrun_burst: 65, max_external_force_n: 1}\n"
    "camera: {driver: synthetic}\n"
    "synthetic: {scene: plane, noise: off, distance_m: 2}\n"
    "simulated_handle: {start_z_m: -1, travel_m: 0.02, stroke_m: 0}\n"
    "control: {engage_at_start: true}\n";

class CommandsOnTheWire : public BoxOnTheWire {
 protected:
  void startBridgeTaking(const std::vector<std::string>& inputs) {
    std::vector<std::string> more{"--control-socket", home_.controlSocket()};
    for (const std::string& input : inputs) more.insert(more.end(), {"--take", input});
    startBridge(more);
    talker_.emplace(domain_);
  }
  void advertise(const std::string& name, const dds_topic_descriptor_t& type) {
    talker_->advertise(topic(name), type);
    ASSERT_TRUE(becomesTrue([&] { return talker_->isMatched(topic(name)); })) << bridge_->errors();
  }
  std_msgs_msg_dds__Header_ head(const std::string& frame = "world") {
    frame_ = namespace_ + "/" + frame;
    return {{0, 0}, frame_.data()};
  }
  void command(const std::string& word) {
    std::string text = word;
    const crtk_msgs_msg_dds__StringStamped_ message{head(), text.data()};
    talker_->publish(topic("state_command"), &message);
  }
  void push(const rt::Vec3& force_n, const std::string& frame = "world",
            std::optional<std::int64_t> sent_utc_ns = {}) {
    const geometry_msgs_msg_dds__WrenchStamped_ message{head(frame), {{force_n.x, force_n.y, force_n.z}, {}}};
    talker_->publish(topic("servo_cf"), &message, sent_utc_ns);
  }
  /// Of the box's newest tick.
  static double external_n(Daemon& daemon) {
    return lengthOf(daemon.status().at("tick").at("externalForceNInWorld"));
  }

  std::optional<RosTalker> talker_;
  std::string frame_;
};

TEST_F(CommandsOnTheWire, ChangeTheStateAsCrtkDefinesIt) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"state_command"});
  listenToState();
  advertise("state_command", crtk_msgs_msg_dds__StringStamped__desc);
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  command("pause");
  ASSERT_TRUE(stateBecomes("PAUSED")) << bridge_->errors();
  EXPECT_EQ(daemon.status().at("mode"), "idle");
  command("enable");
  EXPECT_TRUE(says("the state is PAUSED, which resume ends"));
  command("resume");
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  command("disable");
  ASSERT_TRUE(stateBecomes("DISABLED")) << bridge_->errors();
  command("enable");
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();

  // who engages the box itself ends a pause
  command("pause");
  ASSERT_TRUE(stateBecomes("PAUSED")) << bridge_->errors();
  EXPECT_EQ(home_.control({"engage", "--inside"}).ending, exitedWith(0));
  ASSERT_TRUE(stateBecomes("ENABLED"));
  EXPECT_EQ(home_.control({"disengage"}).ending, exitedWith(0));
  ASSERT_TRUE(stateBecomes("DISABLED"));
}

TEST_F(CommandsOnTheWire, PauseAndResumeWithoutAnotherStateInBetween) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"state_command"});
  listenToState();
  advertise("state_command", crtk_msgs_msg_dds__StringStamped__desc);
  ASSERT_TRUE(stateBecomes("ENABLED")) << bridge_->errors();
  states_.clear();
  std::vector<std::string> expected;
  for (int i = 0; i < 5; ++i) {  // ten commands, as many as are taken in a second
    for (const auto& [word, state] : {std::pair{"pause", "PAUSED"}, std::pair{"resume", "ENABLED"}}) {
      command(word);
      ASSERT_TRUE(stateBecomes(state)) << bridge_->errors();
      expected.emplace_back(state);
    }
  }
  EXPECT_EQ(states_, expected);
}

TEST_F(CommandsOnTheWire, ResumeAndDoNotEnableABoxThatHolds) {
  std::vector<std::string> start =
      home_.command(kEngagedYaml, {"control.allow_fault_injection=true", "safety.depth_timeout_s=0.5"});
  start.insert(start.end(), {"--inject", home_.write("faults", "1 600 frozen_camera\n")});
  Daemon daemon(home_, start);
  ASSERT_TRUE(daemon.answers());
  const std::string file = (home_.path() / "ros.json").string();
  startBridge({"--control-socket", home_.controlSocket(), "--take", "state_command", "--status-file", file});
  talker_.emplace(domain_);
  listenToState();
  advertise("state_command", crtk_msgs_msg_dds__StringStamped__desc);
  ASSERT_TRUE(stateBecomes("PAUSED")) << bridge_->errors();
  EXPECT_EQ(daemon.status().at("mode"), "holding");
  command("enable");
  EXPECT_TRUE(says("the state is PAUSED, which resume ends"));
  command("resume");
  EXPECT_TRUE(becomesTrue([&] {
    const json status = json::parse(home_.control({"--json", "ros", "--file", file}).output, nullptr, false);
    return status.is_object() && status.at("taken").at(0).at("taken") == 1;
  })) << home_.control({"ros", "--file", file}).output;
  command("disable");
  EXPECT_TRUE(stateBecomes("DISABLED"));
}

TEST_F(CommandsOnTheWire, ThatTheConfigurationDoesNotNameAreNotSubscribedTo) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"state_command"});
  advertise("state_command", crtk_msgs_msg_dds__StringStamped__desc);
  talker_->advertise(topic("servo_cf"), geometry_msgs_msg_dds__WrenchStamped__desc);
  // The reader of the other topic is of the same participant, so that this one would be known too.
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_FALSE(talker_->isMatched(topic("servo_cf")));
}

TEST_F(CommandsOnTheWire, AForceActsWhileItIsSentAndEndsByItself) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"servo_cf"});
  advertise("servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  {
    const std::jthread sender([&](const std::stop_token& end) {
      while (!end.stop_requested()) {
        push({0, 0, 0.5});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
    ASSERT_TRUE(daemon.reaches([](const json& status) {
      const json& force = status.at("tick").at("commandForceNInWorld");
      return force.at("z") == 0.5 && force.at("x") == 0 && force.at("y") == 0;
    })) << bridge_->errors();
  }
  ASSERT_TRUE(becomesTrue([&] { return external_n(daemon) == 0; }));
  ASSERT_TRUE(daemon.reaches(
      [](const json& status) { return lengthOf(status.at("tick").at("commandForceNInWorld")) == 0; }));
}

/// The ticks of a hapticd with an external force, and with a command of 1 mN or more.
class ForcedTicks {
 public:
  explicit ForcedTicks(const std::string& socket) : client_(*tools::VarlinkClient::connect(socket)) {
    EXPECT_TRUE(client_.subscribe(
        "io.hapticd.Status.Ticks",
        {{"fields", {"planned_ns", "external_force_n_in_world", "command_force_n_in_world"}},
         {"intervalMs", 5}}));
  }
  /// Reads until a tick that was due at that time or later, CLOCK_MONOTONIC.
  void readUntil(std::int64_t time_ns) {
    for (std::int64_t newest_ns = 0; newest_ns < time_ns;) {
      const auto reply = client_.next(std::chrono::seconds(10));
      ASSERT_TRUE(reply) << reply.error().what;
      const auto& ticks = (*reply)["ticks"];
      for (std::size_t i = 0; i < (*reply)["count"].get<std::size_t>(); ++i) {
        newest_ns = ticks["planned_ns"][i].get<std::int64_t>();
        if (ticks["external_force_n_in_world"][i][2] != 0.0) last_external_ns_ = newest_ns;
        if (std::abs(ticks["command_force_n_in_world"][i][2].get<double>()) >= 1e-3)
          last_command_ns_ = newest_ns;
      }
    }
  }
  std::int64_t last_external_ns() const { return last_external_ns_; }
  std::int64_t last_command_ns() const { return last_command_ns_; }

 private:
  tools::VarlinkClient client_;
  std::int64_t last_external_ns_ = 0;
  std::int64_t last_command_ns_ = 0;
};

TEST_F(CommandsOnTheWire, AForceEndsWithin20MillisecondsOfItsLastMessage) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  ForcedTicks ticks(home_.statusSocket());
  startBridgeTaking({"servo_cf"});
  advertise("servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  for (int round = 0; round < 5; ++round) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    std::int64_t stamp_ns = 0;  // of the newest message, CLOCK_MONOTONIC, not before its stamp
    {
      const std::jthread sender([&](const std::stop_token& end) {
        while (!end.stop_requested()) {
          geometry_msgs_msg_dds__WrenchStamped_ message{head(), {{0, 0, 0.5}, {}}};
          const std::int64_t utc_ns = rt::realtimeNow_ns();
          stamp_ns = rt::monotonicNow_ns();
          message.header.stamp = {static_cast<std::int32_t>(utc_ns / rt::kNsPerSecond),
                                  static_cast<std::uint32_t>(utc_ns % rt::kNsPerSecond)};
          talker_->publish(topic("servo_cf"), &message);
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      });
      ASSERT_TRUE(becomesTrue([&] { return external_n(daemon) > 0; })) << bridge_->errors();
    }
    ticks.readUntil(rt::monotonicNow_ns() + 100'000'000);
    EXPECT_GT(ticks.last_external_ns(), begin_ns);
    // 0.1 ms: the offset between UTC and the monotonic clock, which hapticd-ros measures for each message
    EXPECT_LT(ticks.last_external_ns() - stamp_ns, 20'100'000) << round;
    // the slew limit takes 0.25 ms from 0.5 N, and so one tick
    EXPECT_LT(ticks.last_command_ns() - stamp_ns, 21'100'000) << round;
  }
}

TEST_F(CommandsOnTheWire, ASecondBridgeDoesNotDoubleAForce) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"servo_cf"});
  const Program second({HAPTICD_ROS_PROGRAM, "--socket", home_.statusSocket(), "--control-socket",
                        home_.controlSocket(), "--domain", std::to_string(domain_), "--namespace", namespace_,
                        "--take", "servo_cf"});
  advertise("servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  double largest_n = 0;
  ASSERT_TRUE(becomesTrue([&] {
    push({0, 0, 0.25});
    largest_n = std::max(largest_n, external_n(daemon));
    return contains(bridge_->errors() + second.errors(), "another program feeds forces");
  })) << bridge_->errors()
      << second.errors();
  EXPECT_LE(largest_n, 0.25);
}

TEST_F(CommandsOnTheWire, MoreForcesThanAreAllowedAreRefusedAndTheLoopGoesOn) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"servo_cf", "state_command"});
  advertise("servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
  advertise("state_command", crtk_msgs_msg_dds__StringStamped__desc);
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  ASSERT_TRUE(becomesTrue(
      [&] {
        for (int i = 0; i < 50; ++i) push({0, 0, 0.25});
        command("resume");
        return contains(bridge_->errors(), "there are more than 10 messages a second");
      },
      std::chrono::milliseconds(1)))
      << bridge_->errors();
  EXPECT_LE(external_n(daemon), 0.25);
  EXPECT_TRUE(daemon.ticks());
  EXPECT_TRUE(bridge_->running());
}

TEST_F(CommandsOnTheWire, ARefusedForceDoesNotActAndTheReasonIsLogged) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  const auto refuses = [&](auto send, const std::string& words) {
    startBridgeTaking({"servo_cf"});  // a new one: a reason is logged once in 10 s
    advertise("servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
    // What is soon replaced is not sent again to a reader that has not found its publisher yet.
    EXPECT_TRUE(becomesTrue([&] {
      send();
      return bridge_->errors().contains(words);
    })) << bridge_->errors();
    EXPECT_EQ(external_n(daemon), 0) << words;
    bridge_->signal(SIGTERM);
    EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  refuses([&] { push({0, kNaN, 0}); }, "not finite");
  refuses([&] { push({0, 0, 0.5}, "camera"); }, "its frame_id is");
  refuses([&] { push({0, 0, 0.5}, "world", rt::realtimeNow_ns() - rt::kNsPerSecond); }, "s old");
  refuses([&] { push({0, 0, 0.5}, "world", rt::realtimeNow_ns() + rt::kNsPerSecond); }, "from now");
  refuses(
      [&] {
        geometry_msgs_msg_dds__WrenchStamped_ message{head(), {{0, 0, 0.5}, {0, 0.1, 0}}};
        talker_->publish(topic("servo_cf"), &message);
      },
      "exerts no torques");
  EXPECT_EQ(home_.control({"set", "safety.max_external_force_n=0"}).ending, exitedWith(0));
  refuses([&] { push({0, 0, 0.5}); }, "safety.max_external_force_n is 0");
}

TEST_F(CommandsOnTheWire, AnImpedanceIsHeldUntilAnotherOneComes) {
  Daemon daemon(home_, kFreeYaml);
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"servo_ci"});
  advertise("servo_ci", crtk_msgs_msg_dds__CartesianImpedance__desc);
  crtk_msgs_msg_dds__CartesianImpedance_ box{};
  box.header = head();
  box.force_orientation.w = box.torque_orientation.w = 1;
  box.force_position = {0, 0, -1};
  box.position_positive.p = box.position_negative.p = {-500, -500, -500};
  box.position_positive.deadband = box.position_negative.deadband = {0.01, 0.01, 0.01};
  const auto names = [&] {
    std::vector<std::string> all;
    const json listed = json::parse(home_.control({"--json", "fixture", "list"}).output);
    for (const json& fixture : listed.at("fixtures")) all.push_back(fixture.at("name"));
    return all;
  };
  talker_->publish(topic("servo_ci"), &box);
  ASSERT_TRUE(becomesTrue([&] { return names().size() == 6; })) << bridge_->errors();
  std::this_thread::sleep_for(std::chrono::seconds(1));  // one is taken 10 times a second at most
  box.position_positive.p = box.position_negative.p = {-500, 0, 0};
  talker_->publish(topic("servo_ci"), &box);
  ASSERT_TRUE(becomesTrue([&] { return names().size() == 2; })) << bridge_->errors();
  EXPECT_EQ(names(), (std::vector<std::string>{"ros-x-positive", "ros-x-negative"}));
}

TEST_F(CommandsOnTheWire, PosesMoveAFrame) {
  Daemon daemon(home_,
                kFreeYaml +
                    "frames:\n  - {name: phantom}\n"
                    "fixtures:\n  - {name: nerve, kind: sphere, frame: phantom, position_m: [0, 0, 0], "
                    "radius_m: 0.01}\n");
  ASSERT_TRUE(daemon.answers());
  startBridgeTaking({"frame:phantom"});
  advertise("frames/phantom", geometry_msgs_msg_dds__PoseStamped__desc);
  const auto frame = [&] { return daemon.status().at("frames").at(0); };
  ASSERT_TRUE(becomesTrue(
      [&] {
        const geometry_msgs_msg_dds__PoseStamped_ pose{head(), {{0.1, 0.2, -1}, {0, 0, 0, 1}}};
        talker_->publish(topic("frames/phantom"), &pose);
        return frame().at("accepted") >= 10;
      },
      std::chrono::milliseconds(10)))
      << frame() << bridge_->errors();
}

}  // namespace
}  // namespace hapticd::test
