// SPDX-License-Identifier: Apache-2.0
// The end of hapticd: exit status 0, no socket file, no process, whenever the signal comes.

#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

const std::vector<std::string> kOnlyTheFile{"hapticd.yaml"};

class DaemonStopBySignal : public testing::TestWithParam<int> {};

TEST_P(DaemonStopBySignal, EndsWithStatusZeroAndLeavesNothing) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  daemon.signal(GetParam());
  EXPECT_EQ(daemon.wait(), exitedWith(0)) << daemon.errors();
  EXPECT_FALSE(daemon.leftProcesses());
  EXPECT_EQ(home.entries(), kOnlyTheFile);
}

INSTANTIATE_TEST_SUITE_P(Signals, DaemonStopBySignal, testing::Values(SIGTERM, SIGINT),
                         [](const auto& instance) {
                           return std::string(instance.param == SIGTERM ? "Term" : "Int");
                         });

TEST(DaemonStop, EndsWhileItPresses) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {"control.engage_at_start=true"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("mode") == "engaged" && test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 1;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  EXPECT_EQ(home.entries(), kOnlyTheFile);
}

TEST(DaemonStop, EndsWhileItPressesThroughEveryStage) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml,
                {"control.engage_at_start=true", "safety.force_filter_hz=80", "safety.max_slew_n_per_s=2",
                 "safety.continuous_force_n=0.5", "safety.thermal_time_s=1", "blend.duration_s=0.5",
                 "safety.passivity_control=true", "safety.stiffness_limit=reduce"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("mode") == "engaged" &&
           test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 0.3;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0)) << daemon.errors();
  EXPECT_EQ(home.entries(), kOnlyTheFile);
}

TEST(DaemonStop, EndsWhenTheSignalComesTwice) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  daemon.signal(SIGTERM);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), exitedWith(0));
  EXPECT_EQ(home.entries(), kOnlyTheFile);
}

TEST(DaemonStop, EndsInOrderFromTheMomentItsFirstSocketIsThere) {
  for (int round = 0; round < 10; ++round) {
    const DaemonHome home;
    Daemon daemon(home);
    // without a pause, to be as early as possible
    ASSERT_TRUE(
        test::becomesTrue([&] { return !daemon.running() || std::filesystem::exists(home.statusSocket()); },
                          std::chrono::milliseconds(0)));
    EXPECT_EQ(daemon.terminate(), exitedWith(0)) << daemon.errors();
    EXPECT_EQ(home.entries(), kOnlyTheFile);
  }
}

TEST(DaemonStop, LeavesNothingWhenTheSignalComesAnywhereInTheStart) {
  for (int round = 0; round < 20; ++round) {
    const DaemonHome home;
    Daemon daemon(home);
    std::this_thread::sleep_for(std::chrono::milliseconds(2 * round));  // any moment will do
    const test::Ending ending = daemon.terminate();
    // Before it has begun to serve, the signal itself ends it.
    EXPECT_TRUE(ending == exitedWith(0) || ending == (test::Ending{false, SIGTERM})) << ending;
    EXPECT_EQ(home.entries(), kOnlyTheFile);
  }
}

TEST(DaemonStop, SurvivesThatNobodyReadsItsMessages) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {}, {.stderr_broken = true});
  ASSERT_TRUE(daemon.answers());
  // Each change is logged.
  EXPECT_EQ(home.control({"set", "force.stiffness_n_per_m=400"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
