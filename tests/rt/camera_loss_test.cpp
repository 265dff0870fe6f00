// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

#include "rt/loop/supervisor.h"
#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::FixtureKind;
using rt::Mode;
using rt::Supervisor;
using rt::Tick;
using rt::Vec3;

// What acts while the camera is lost: fixtures that need no depth, and nothing else.

constexpr Vec3 kPressed{0, 0, -0.005};
constexpr int kStale_ticks = 501;  // safety.depth_timeout_s
constexpr int kFade_ticks = 201;   // safety.depth_ramp_s
constexpr int kRamp_ticks = 501;   // safety.engage_ramp_s

class CameraLoss : public testing::Test {
 protected:
  /// Lets the camera be lost for so many ticks beyond the timeout.
  Tick lose(int ticks, const Vec3& offset_m = kPressed) {
    core.rig.scene_fresh = false;
    return hold(kStale_ticks + ticks, offset_m);
  }
  Tick hold(int ticks, const Vec3& offset_m = kPressed) {
    Tick tick;
    for (int i = 0; i < ticks; ++i) tick = core.at(offset_m);
    return tick;
  }
  /// Engages while pressed, and waits until the fixtures have grown to there.
  void engage() {
    core.engage(kPressed);
    hold(1500);
  }
  static double forceOf(const Tick& tick) { return norm(tick.command_force_n_in_world); }

  FixtureCore core;
};

TEST_F(CameraLoss, LeavesAShapeAsItIs) {
  core.add(FixtureKind::plane, floor());
  engage();
  const Tick before = hold(1);
  ASSERT_GT(forceOf(before), 1);
  const Tick lost = lose(2000);
  EXPECT_EQ(lost.mode, Mode::engaged);
  EXPECT_EQ(lost.cause, Cause::depth_stale);
  EXPECT_EQ(lost.depth_share, 0);
  EXPECT_NEAR(forceOf(lost), forceOf(before), 1e-9);
  core.rig.scene_fresh = true;
  EXPECT_EQ(hold(kRamp_ticks).cause, Cause::requested);
  EXPECT_EQ(hold(1).depth_share, 1);
}

TEST_F(CameraLoss, EndsAFixtureThatIsToFadeAndLetsItBeginAnew) {
  core.add(FixtureKind::plane, floor(-0.1));
  core.add(FixtureKind::plane, floor()).fades_without_depth = true;
  engage();
  const double pressed_n = forceOf(hold(1));
  ASSERT_GT(pressed_n, 1);
  lose(0);
  double before_n = pressed_n;
  for (int i = 0; i < kFade_ticks; ++i) {
    const double now_n = forceOf(hold(1));
    EXPECT_LE(now_n, before_n + 1e-12);
    EXPECT_LE(before_n - now_n, 1.5 * pressed_n / kFade_ticks);
    before_n = now_n;
  }
  EXPECT_EQ(before_n, 0);
  EXPECT_TRUE(std::isnan(core.rig.core.fixture(1).distance_m));
  core.rig.scene_fresh = true;
  EXPECT_LT(forceOf(hold(1)), 1e-3);
  EXPECT_NEAR(forceOf(hold(4000)), pressed_n, 1e-9);
}

TEST_F(CameraLoss, HoldsWhereNothingIsToGoOn) {
  core.add(FixtureKind::plane, floor()).fades_without_depth = true;
  rt::Fixture& off = core.add(FixtureKind::plane, floor());
  off.enabled = false;
  engage();
  const Tick lost = lose(kFade_ticks);
  EXPECT_EQ(lost.mode, Mode::holding);
  EXPECT_EQ(lost.cause, Cause::depth_stale);
  EXPECT_EQ(forceOf(lost), 0);
}

TEST_F(CameraLoss, IsNoReasonToEngage) {
  core.add(FixtureKind::plane, floor());
  core.rig.scene_fresh = false;
  hold(kStale_ticks);
  core.rig.directive.engage = true;
  EXPECT_EQ(hold(kRamp_ticks).mode, Mode::holding);
}

TEST_F(CameraLoss, DoesNotHideWhatIsWorse) {
  core.add(FixtureKind::plane, floor());
  engage();
  lose(10);
  core.rig.overran = true;
  EXPECT_EQ(hold(64).cause, Cause::overrun_burst);
  core.rig.overran = false;
  EXPECT_EQ(hold(2000).mode, Mode::engaged);
  core.rig.handle_fresh = false;
  const Tick tick = core.rig.steps(100);
  EXPECT_EQ(tick.cause, Cause::handle_stale);
  EXPECT_EQ(forceOf(tick), 0);
}

// Losing and seeing the scene again at any moment, with any mix of fixtures, changes the force no faster than
// the hand's motion, the fade and the growth of what returns explain.
TEST_F(CameraLoss, NeverStepsTheForce) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  double stiffness_n_per_m = 0;
  double most_n = 0;
  for (int i = 0; i < 6; ++i) {
    rt::Fixture& f = i % 2 == 0 ? core.add(FixtureKind::plane, floor(-0.004 * i))
                                : core.add(FixtureKind::sphere, sphere(0.03, {0, 0, -0.03 - 0.004 * i}));
    f.fades_without_depth = i % 3 != 0;
    f.stiffness_n_per_m = 50 + 100 * unit(random);
    f.max_force_n = 0.5;
    stiffness_n_per_m += f.stiffness_n_per_m;
    most_n += f.max_force_n;
  }
  core.rig.directive.parameters.safety.max_force_n = 2 * most_n;
  core.rig.directive.parameters.safety.passivity_control = false;
  core.engage({0, 0, 0.01});
  Vec3 place{0, 0, 0.01};
  Vec3 force = hold(1, place).command_force_n_in_world;
  int lost = 0;
  for (int tick = 0; tick < 20'000; ++tick) {
    const double t = 0.001 * tick;
    const Vec3 next{0.02 * std::sin(3 * t), 0.01 * std::sin(2.3 * t),
                    0.01 - 0.025 * std::pow(std::sin(1.7 * t), 2)};
    if (unit(random) < 0.002) core.rig.scene_fresh = !core.rig.scene_fresh;
    const Tick result = core.at(next, {});
    if (result.depth_share == 0) ++lost;
    const double moved_m = norm(next - place);
    const double explained_n =
        stiffness_n_per_m * (moved_m + rt::kMaxGrowth_m_per_s * kPeriod_s) + most_n * kPeriod_s / 0.2;
    ASSERT_LE(norm(result.command_force_n_in_world - force), explained_n + 0.01) << tick;
    place = next;
    force = result.command_force_n_in_world;
  }
  EXPECT_GT(lost, 2000);
}

// Behaviour of the mode state machine for a law that holds a surface at its last seen position because it has
// come nearer than the camera can measure.

constexpr double kTick_s = 0.001;

/// A supervisor with valid inputs and a law result set by the test.
class TooNearSurface : public testing::Test {
 protected:
  TooNearSurface() {
    scene.frame = 1;
    handle.sequence = 1;
    directive.engage = true;
    directive.engage_inside = true;
  }

  void step(const Supervisor::Contact& contact) {
    now_ns += 1'000'000;
    handle.time_ns = now_ns;
    if (depth_is_fresh) scene.frame_time_ns = now_ns;
    const Supervisor::Input input{now_ns, kTick_s, scene, handle, directive, start};
    supervisor.decide(input, supervisor.look(input), contact);
  }
  void steps(int count, const Supervisor::Contact& contact) {
    for (int i = 0; i < count; ++i) step(contact);
  }
  void expect(Mode mode, Cause cause) const {
    EXPECT_EQ(supervisor.mode(), mode);
    EXPECT_EQ(supervisor.cause(), cause);
  }

  static constexpr Supervisor::Contact kSeen{.in_contact = true, .too_near = false};
  static constexpr Supervisor::Contact kTooNear{.in_contact = true, .too_near = true};
  static constexpr Supervisor::Contact kNothing{};

  Supervisor supervisor;
  rt::Scene scene;
  rt::HandleState handle;
  rt::StartParameters start;
  rt::Directive directive;  // the timeout is 0.5 s, the fade 0.2 s, the engage ramp 0.5 s
  bool depth_is_fresh = true;
  std::int64_t now_ns = 5'000'000'000;
};

TEST_F(TooNearSurface, IsHeldForTheTimeoutOfDepthAndThenFades) {
  steps(501, kSeen);
  ASSERT_EQ(supervisor.gain(), 1);
  steps(501, kTooNear);  // the first of them is 500 ms old
  expect(Mode::engaged, Cause::requested);
  EXPECT_EQ(supervisor.gain(), 1);
  step(kTooNear);
  expect(Mode::holding, Cause::surface_too_near);
  constexpr double kRounding = 1e-9;  // of 200 sums
  EXPECT_NEAR(supervisor.gain(), 1 - kTick_s / 0.2, kRounding);
  steps(100, kTooNear);
  EXPECT_NEAR(supervisor.gain(), 1 - 101 * kTick_s / 0.2, kRounding);
  steps(100, kTooNear);
  EXPECT_EQ(supervisor.gain(), 0);
  expect(Mode::holding, Cause::surface_too_near);
}

TEST_F(TooNearSurface, EndsByItselfWhenItIsSeenAgain) {
  steps(1'500, kTooNear);
  ASSERT_EQ(supervisor.cause(), Cause::surface_too_near);
  step(kSeen);
  expect(Mode::engaged, Cause::requested);
  EXPECT_NEAR(supervisor.gain(), kTick_s / 0.5, 1e-12) << "the ramp restarts";
}

TEST_F(TooNearSurface, EndsByItselfWhenTheContactEnds) {
  steps(1'500, kTooNear);
  step(kNothing);
  expect(Mode::engaged, Cause::requested);
}

TEST_F(TooNearSurface, RestartsTheTimeoutWhenTheSurfaceIsSeen) {
  step(kSeen);
  for (int i = 0; i < 10; ++i) {
    steps(400, kTooNear);
    step(kSeen);
  }
  expect(Mode::engaged, Cause::requested);
}

TEST_F(TooNearSurface, YieldsToTheCauseStaleDepth) {
  steps(2, kSeen);
  depth_is_fresh = false;
  steps(1'000, kTooNear);
  expect(Mode::holding, Cause::depth_stale);
  depth_is_fresh = true;
  step(kTooNear);
  expect(Mode::holding, Cause::surface_too_near);
}

TEST_F(TooNearSurface, IsNoCauseWhileNobodyIsEngaged) {
  directive.engage = false;
  steps(1'500, kTooNear);
  EXPECT_EQ(supervisor.mode(), Mode::idle);
  EXPECT_NE(supervisor.cause(), Cause::surface_too_near);
}

}  // namespace
}  // namespace hapticd::test
