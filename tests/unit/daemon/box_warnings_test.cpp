// SPDX-License-Identifier: Apache-2.0
// The one list of what is wrong with the box, and that its remedies lead somewhere.
#include "daemon/box_warnings.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "rt/base/words.h"

namespace hapticd::daemon {
namespace {

struct Case {
  BoxStatus status;
  config::Settings settings;
  rt::LoopPrivileges privileges{true, true, 3};
  Lateness lateness;
  std::optional<drivers::CpuQuota> cpu_quota;
  bool cpus_may_sleep = false;
  bool cpu_is_isolated = true;

  Case() {
    status.camera.state = drivers::CameraState::streaming;
    status.handle.state = drivers::HandlePresence::present;
    status.loop.state.tick.mode = rt::Mode::idle;
  }
  std::vector<std::string> warnings() const {
    return warningsOf(status, {.settings = settings,
                               .live = settings.live,
                               .privileges = privileges,
                               .cpus_may_sleep = cpus_may_sleep,
                               .cpu_is_isolated = cpu_is_isolated,
                               .lateness = lateness,
                               .cpu_quota = cpu_quota});
  }
};

TEST(BoxWarnings, AreNoneWhereAllIsWell) {
  EXPECT_EQ(Case().warnings(), std::vector<std::string>{});
}

TEST(BoxWarnings, SayThatSpringsWaitForTheHandToLeaveThem) {
  Case waiting;
  rt::Tick& tick = waiting.status.loop.state.tick;
  tick.mode = rt::Mode::engaged;
  tick.law = rt::ForceLaw::nearest_springs;
  tick.points_used = 100;
  ASSERT_EQ(waiting.warnings().size(), 1U);
  EXPECT_TRUE(waiting.warnings()[0].starts_with("the law nearest_springs exerts nothing, because the hand"));
  tick.law_force_n_in_world = {0, 0, 1};
  EXPECT_TRUE(waiting.warnings().empty());
  tick.law_force_n_in_world = {};
  tick.mode = rt::Mode::holding;
  EXPECT_TRUE(waiting.warnings().empty());
  tick.mode = rt::Mode::engaged;
  tick.law = rt::ForceLaw::proxy;
  EXPECT_TRUE(waiting.warnings().empty()) << "the state of contact says it";
}

TEST(BoxWarnings, NameAFrameThatIsLostWhereAFixtureDependsOnIt) {
  Case lost;
  lost.status.frames = {{.name = "tool", .state = rt::FrameState::lost, .used = false},
                        {.name = "phantom", .state = rt::FrameState::lost, .used = true, .age_s = 2.13},
                        {.name = "bone", .state = rt::FrameState::none, .used = true},
                        {.name = "head", .state = rt::FrameState::catching_up, .used = true},
                        {.name = "organ",
                         .state = rt::FrameState::lost,
                         .used = true,
                         .tracks = "liver",
                         .tracking = rt::TrackingVerdict::low_share},
                        {.name = "skull", .used = true, .tracks = "bone"},
                        {.name = "vessel",
                         .state = rt::FrameState::lost,
                         .used = true,
                         .tracks = "wall",
                         .tracking = rt::TrackingVerdict::tracked},
                        {.name = "arm",
                         .state = rt::FrameState::lost,
                         .used = true,
                         .refusal = rt::PoseFault::repeated,
                         .age_s = 1}};
  const std::vector<std::string> warnings = lost.warnings();
  ASSERT_EQ(warnings.size(), 6U);
  EXPECT_TRUE(warnings[0].starts_with("frame phantom is lost: no usable pose for 2.1 s")) << warnings[0];
  EXPECT_TRUE(warnings[1].starts_with("frame bone has no place yet")) << warnings[1];
  EXPECT_TRUE(warnings[2].starts_with("frame organ is not followed: the depth camera says low_share"))
      << warnings[2];
  EXPECT_TRUE(warnings[3].starts_with("frame skull is not followed: no depth frame has come")) << warnings[3];
  EXPECT_TRUE(warnings[4].starts_with("frame vessel is not followed: no depth frame has come"))
      << warnings[4];
  EXPECT_TRUE(
      warnings[5].starts_with("frame arm is lost: no usable pose for 1.0 s; its poses are refused: it is "
                              "the pose before to the last bit"))
      << warnings[5];
}

TEST(BoxWarnings, NameAFaultByItsCause) {
  Case faulted;
  faulted.status.loop.state.tick.mode = rt::Mode::faulted;
  faulted.status.loop.state.tick.cause = rt::Cause::force_not_finite;
  EXPECT_EQ(
      faulted.warnings(),
      std::vector<std::string>{"faulted: the force law computed a number that is not finite (correct the "
                               "cause, then: hapticctl clear-fault)"});
}

TEST(BoxWarnings, SayHowLateTheForceLoopIsAndWhatHelpsHere) {
  Case late;
  late.lateness = {true, 60'000, 70, 12};
  const auto only = [&late] {
    const auto all = late.warnings();
    return all.empty() ? std::string() : all.front();
  };
  EXPECT_TRUE(
      only().starts_with("the force loop is late: 70 of 60000 ticks, and 12 periods without one, within the "
                         "last minute ("))
      << only();
  EXPECT_NE(only().find("CPU 3 runs nothing else"), std::string::npos) << only();
  late.cpu_is_isolated = false;
  EXPECT_NE(only().find("hapticd-realtime-setup apply"), std::string::npos) << only();
  late.privileges.realtime_scheduling = false;
  EXPECT_NE(only().find("LimitRTPRIO="), std::string::npos) << only();
  late.cpu_quota = drivers::CpuQuota{"/box", 0.15, 60, 59};
  EXPECT_NE(only().find("/box has 0.15 CPUs, and its processes were paused in 59 of 60 periods: raise"),
            std::string::npos)
      << only();
  late.lateness.late = false;
  EXPECT_EQ(only().find("is late"), std::string::npos) << only();
}

// 'hapticctl doctor' shows these warnings, and status shows them too: neither is a remedy.
TEST(BoxWarnings, NameADeviceThatDoesNotDoWhatItSays) {
  Case box;
  box.status.loop.state.tick.handle.velocity_claim = rt::VelocityClaim::none;
  box.status.loop.state.tick.hidden_latency_s = 0.002;
  EXPECT_TRUE(box.warnings().empty());
  box.status.loop.state.tick.handle.velocity_claim = rt::VelocityClaim::distrusted;
  ASSERT_EQ(box.warnings().size(), 1U);
  EXPECT_TRUE(box.warnings()[0].contains("positions contradict")) << box.warnings()[0];
  box.status.loop.state.tick.handle.velocity_claim = rt::VelocityClaim::consistent;
  box.status.loop.state.tick.hidden_latency_s = 0.0121;
  ASSERT_EQ(box.warnings().size(), 1U);
  EXPECT_TRUE(box.warnings()[0].starts_with("forces act 12 ms later")) << box.warnings()[0];
  box.status.loop.state.tick.hidden_latency_s = 0;
  box.status.loop.state.tick.handle.probes = true;
  box.status.loop.state.latency.number = 2;
  EXPECT_TRUE(box.warnings().empty()) << "it is tried three times";
  box.status.loop.state.latency.number = 3;
  ASSERT_EQ(box.warnings().size(), 1U);
  EXPECT_TRUE(box.warnings()[0].starts_with("the device did not move")) << box.warnings()[0];
  box.status.loop.state.latency.conclusive = true;
  box.status.loop.state.latency.mass_kg = 0.04;
  EXPECT_TRUE(box.warnings().empty()) << box.warnings()[0];
  box.status.loop.state.latency.mass_kg = 0.0102;
  ASSERT_EQ(box.warnings().size(), 1U);
  EXPECT_TRUE(box.warnings()[0].starts_with("the device moves like one of 10 g and not of 45 g"))
      << box.warnings()[0];
}

TEST(BoxWarnings, NeverSendAReaderInACircle) {
  std::vector<std::string> all;
  for (const bool realtime : {true, false}) {
    for (const bool isolated : {true, false}) {
      Case wrong;
      wrong.status.loop.state.tick.mode = rt::Mode::faulted;
      wrong.status.loop.state.tick.stiffness_limit_n_per_m = 1;
      wrong.status.camera.state = drivers::CameraState::lost;
      wrong.status.camera.detail = "gone (check the cable)";
      wrong.status.handle.state = drivers::HandlePresence::lost;
      wrong.status.handle.detail = "gone (check the cable)";
      wrong.status.scene.points_over_capacity = 1;
      wrong.status.handle.scheduling = {50, 0};
      wrong.privileges = {realtime, false, -1};
      wrong.cpus_may_sleep = true;
      wrong.cpu_is_isolated = isolated;
      wrong.lateness = {true, 60'000, 70, 12};
      for (std::string& text : wrong.warnings()) all.push_back(std::move(text));
    }
  }
  ASSERT_GT(all.size(), 30U);
  for (const std::string& text : all) {
    EXPECT_EQ(text.find("hapticctl doctor"), std::string::npos) << text;
    EXPECT_EQ(text.find("hapticctl status"), std::string::npos) << text;
    EXPECT_NE(text.find('('), std::string::npos) << "no remedy: " << text;
  }
}

}  // namespace
}  // namespace hapticd::daemon
