// SPDX-License-Identifier: Apache-2.0
// hapticd-ros at a network interface that is not the loopback one, in a network namespace of the test's own.
#include <fmt/format.h>
#include <sched.h>

#include <cstdlib>

#include "tests/ros/box_on_the_wire.h"

namespace hapticd::test {
namespace {

constexpr const char* kInterface = "ros0";

bool runs(const std::string& command) {
  return std::system(command.c_str()) == 0;
}

/// Gives this process and its later children, which are in a network of their own, an interface whose other
/// end reads nothing. Returns what failed; empty: nothing did.
std::string makeNetwork() {
  for (const char* const command :
       {"ip link set lo up", "ip link add ros0 type veth peer name ros1",
        "ip address add 10.77.0.1/24 dev ros0", "ip link set ros0 up", "ip link set ros1 up"}) {
    if (!runs(command)) return std::string(command) + " failed";
  }
  return "";
}

/// As a ROS 2 program with the discovery range SUBNET has it.
constexpr const char* kSubnet =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface "
    "name=\"ros0\"/></Interfaces></General></Domain>"
    "</CycloneDDS>";

class RosNetwork : public ::testing::Test {
 protected:
  void SetUp() override {
    if (::unshare(CLONE_NEWNET) != 0) GTEST_SKIP() << "a network namespace is not permitted here";
    ASSERT_EQ(makeNetwork(), "");
  }
  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> all{
        HAPTICD_ROS_PROGRAM, "--socket", home_.statusSocket(), "--control-socket", home_.controlSocket(),
        "--interface",       kInterface};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  DaemonHome home_;
};

TEST_F(RosNetwork, TakesNoCommandsFromOtherComputersUnlessAPersonAllowsIt) {
  Program refused(command({"--take", "servo_cf"}));
  EXPECT_EQ(refused.wait(), exitedWith(64));
  EXPECT_TRUE(refused.errors().contains("every computer that reaches ros0 could command the box"))
      << refused.errors();
  EXPECT_TRUE(refused.errors().contains("--network-may-command")) << refused.errors();
  Program allowed(command({"--take", "servo_cf", "--network-may-command"}));
  EXPECT_TRUE(becomesTrue([&] { return allowed.output().contains("at ros0"); })) << allowed.errors();
  allowed.signal(SIGTERM);
  EXPECT_EQ(allowed.wait(), exitedWith(0));
}

TEST_F(RosNetwork, IsFoundByMulticastAndAgainAfterTheInterfaceWasDown) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  Program bridge(command({}));
  RosListener listener(0, kSubnet);
  listener.subscribe("rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc);
  const auto hears = [&] { return !listener.take("rt/hapticd/measured_cp").empty(); };
  ASSERT_TRUE(becomesTrue(hears)) << bridge.errors();
  ASSERT_TRUE(runs("ip link set ros0 down"));
  EXPECT_TRUE(daemon.ticks());
  ASSERT_TRUE(runs("ip link set ros0 up"));
  (void)listener.take("rt/hapticd/measured_cp");
  EXPECT_TRUE(becomesTrue(hears)) << bridge.errors();
  EXPECT_TRUE(bridge.running());
}

TEST_F(RosNetwork, IsNotHeardInAnotherDomain) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  Program bridge(command({"--domain", "3"}));
  RosListener same(3, kSubnet);
  RosListener other(4, kSubnet);
  for (RosListener* listener : {&same, &other})
    listener->subscribe("rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc);
  ASSERT_TRUE(becomesTrue([&] { return !same.take("rt/hapticd/measured_cp").empty(); })) << bridge.errors();
  EXPECT_FALSE(other.isMatched("rt/hapticd/measured_cp"));
  EXPECT_FALSE(other.writerOf("rt/hapticd/measured_cp"));
}

TEST_F(RosNetwork, EndsAtSigtermWhileItPublishesToAnother) {
  Daemon daemon(home_, kEngagedYaml);
  ASSERT_TRUE(daemon.answers());
  Program bridge(command({"--rate", "1000"}));
  RosListener listener(0, kSubnet);
  listener.subscribe("rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc);
  ASSERT_TRUE(becomesTrue([&] { return !listener.take("rt/hapticd/measured_cp").empty(); }))
      << bridge.errors();
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), exitedWith(0)) << bridge.errors();
}

}  // namespace
}  // namespace hapticd::test
