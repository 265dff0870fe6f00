// SPDX-License-Identifier: Apache-2.0
// What acts while the camera is lost: fixtures that need no depth, and nothing else.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/rt/fixture_core.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::FixtureKind;
using rt::Mode;
using rt::Tick;
using rt::Vec3;

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

}  // namespace
}  // namespace hapticd::test
