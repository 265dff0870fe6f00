// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>

#include "config/settings/settings.h"
#include "daemon/running_box.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/channels/handle_channel.h"
#include "tests/support/program.h"
#include "tests/system/support/daemon_under_test.h"

// Requesting force that already acts.
namespace hapticd {
namespace {

TEST(EngageAgain, InContactKeepsModeAndForce) {
  const test::DaemonHome home;
  test::Daemon daemon(home, test::kWallYaml, {"safety.engage_inside=false"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(
      [](const nlohmann::json& status) { return test::lengthOf(status["tick"]["lawForceNInWorld"]) > 0.1; }));
  EXPECT_EQ(home.control({"engage"}).ending, test::exitedWith(1));  // inside the surface
  EXPECT_EQ(home.control({"engage", "--inside"}).ending, test::exitedWith(0));
  const auto isFelt = [](const nlohmann::json& status) {
    return status["mode"] == "engaged" && test::lengthOf(status["tick"]["commandForceNInWorld"]) > 0.1;
  };
  ASSERT_TRUE(daemon.reaches(isFelt));

  const test::Finished again = home.control({"engage"});
  EXPECT_EQ(again.ending, test::exitedWith(0)) << again.errors;
  EXPECT_TRUE(test::contains(again.output, "nothing changed"));
  EXPECT_TRUE(daemon.reaches(isFelt));
  EXPECT_EQ(daemon.status()["loop"]["transitions"]["byCause"]["inside_surface"], 1);  // of the first request
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0)) << daemon.errors();
}

}  // namespace
}  // namespace hapticd

namespace hapticd::daemon {
namespace {

// The force when the box stops: no process shows it, so the RunningBox itself is tested.

/// A hand that presses on a plane 1 m away.
config::Settings pressing() {
  config::Settings settings;
  settings.camera.driver = "synthetic";
  settings.camera.of<drivers::SyntheticSettings>().scene = drivers::SyntheticScene::plane;
  settings.camera.of<drivers::SyntheticSettings>().noise = drivers::SyntheticNoise::off;
  settings.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world = {0, 0, -0.97};
  settings.handle.of<drivers::SimulatedHandleSettings>().travel_m = 0.02;
  settings.live.force.law = rt::ForceLaw::nearest_springs;
  settings.live.safety.handle_timeout_s = 1;
  settings.live.safety.depth_timeout_s = 5;
  settings.live.safety.engage_inside = true;
  settings.live.safety.overrun_burst = 65;
  settings.live.safety.max_slew_n_per_s = 500;
  settings.control.engage_at_start = true;
  return settings;
}

std::int64_t wokeAt_ns(const rt::Tick& tick) {
  return tick.planned_ns + tick.wakeup_latency_ns;
}

TEST(StopForce, GoesToZeroWithinTheSlewLimitBeforeTheLoopEnds) {
  const config::Settings settings = pressing();
  RunningBox box(settings);
  std::vector<rt::Tick> ticks;
  const auto keep = [&ticks](const rt::Tick& tick) { ticks.push_back(tick); };
  ASSERT_TRUE(box.start());
  ASSERT_TRUE(test::becomesTrue([&] {
    box.drainTicks(keep);
    return !ticks.empty() && norm(ticks.back().command_force_n_in_world) > 1;
  }));
  box.stop();
  box.drainTicks(keep);

  EXPECT_EQ(ticks.back().command_force_n_in_world, rt::Vec3{});
  // Above: 1 N and more; at 500 N/s for the 1 ms of a tick it takes at least 2 ticks to zero.
  const double step_n = settings.live.safety.max_slew_n_per_s / settings.loop.rate_hz;
  double largest_step_n = 0;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const rt::Tick& before = ticks[i - 1];
    EXPECT_EQ(ticks[i].number, before.number + 1);  // otherwise a step could have been missed
    // A device drops the force of a command that has become too old.
    const bool exerted = wokeAt_ns(ticks[i]) - wokeAt_ns(before) <= rt::kCommandLife_ns;
    const rt::Vec3 from_n = exerted ? before.command_force_n_in_world : rt::Vec3{};
    largest_step_n = std::max(largest_step_n, norm(ticks[i].command_force_n_in_world - from_n));
  }
  EXPECT_LE(largest_step_n, step_n * (1 + 1e-9));  // rounding of a double
}

}  // namespace
}  // namespace hapticd::daemon

namespace hapticd {
namespace {

using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

// The end of hapticd: exit status 0, no socket file, no process, whenever the signal comes.

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
