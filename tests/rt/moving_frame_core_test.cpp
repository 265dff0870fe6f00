// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/rt/core_rig.h"

// Fixtures that move with a frame, in the whole tick: what reaches the hand, and its energy.
namespace hapticd::test {
namespace {

using rt::Cause;
using rt::FixtureKind;
using rt::Mode;
using rt::OnFrameLoss;
using rt::Vec3;

constexpr double kStiffness = FixtureCore::kStiffness;

/// A core with a frame whose poses are those of the world's axes at `place`, 100 of them a second.
class MovingCore : public FixtureCore {
 public:
  explicit MovingCore(OnFrameLoss on_loss = OnFrameLoss::fade) {
    set->frame_count = 1;
    set->frames[0] = {.identity = 1, .on_loss = on_loss};
  }
  /// A floor through the frame's origin.
  void addFloor(double stiffness_n_per_m = kStiffness) {
    rt::Fixture& fixture = add(FixtureKind::plane, floor());
    fixture.shape.position_m_in_world = {};  // in the frame
    fixture.frame = 0;
    fixture.stiffness_n_per_m = stiffness_n_per_m;
    redefine(fixture);
  }
  rt::Tick tick(const Vec3& offset_m) {
    rig.poses.clear();
    if (feeds && ++ticks_ % 10 == 0) {
      rig.poses.push_back({.frame = 1,
                           .number = ++number_,
                           .T_world_frame = {origin + place, {}},
                           .time_ns = rig.now_ns - 10'000'000});
    }
    return at(offset_m);
  }
  rt::Tick ticks(int count, const Vec3& offset_m) {
    rt::Tick last;
    for (int i = 0; i < count; ++i) last = tick(offset_m);
    return last;
  }
  void engageAt(const Vec3& offset_m) {
    rig.directive.engage = true;
    ticks(700, offset_m);
  }

  Vec3 place;  ///< of the frame's origin, from `origin`
  bool feeds = true;

 private:
  int ticks_ = 0;
  std::uint64_t number_ = 0;
};

TEST(MovingFrameCore, HoldsTheHandOffAFloorThatItsFrameHasBroughtThere) {
  MovingCore core;
  core.place = {0, 0, -0.02};
  core.addFloor();
  core.engageAt({});
  EXPECT_NEAR(core.tick({}).fixture_distance_m, 0.02, 1e-9);
  for (int i = 0; i < 1500; ++i) {
    core.place.z = std::min(-0.02 + 2e-5 * i, 0.004);
    core.tick({});
  }
  const rt::Tick tick = core.ticks(500, {});
  EXPECT_NEAR(tick.fixture_force_n_in_world.z, kStiffness * 0.004, 1e-6);
  EXPECT_NEAR(tick.command_force_n_in_world.z, kStiffness * 0.004, 1e-3);
  EXPECT_EQ(tick.mode, Mode::engaged);
}

TEST(MovingFrameCore, AnUnusedFrameChangesNoBit) {
  MovingCore with;
  FixtureCore without;
  for (FixtureCore* core : {static_cast<FixtureCore*>(&with), &without}) {
    core->add(FixtureKind::plane, floor());
    core->rig.directive.engage = true;
  }
  for (int i = 0; i < 1000; ++i) {
    const Vec3 offset{0, 0, 0.01 * std::sin(0.01 * i)};
    const rt::Tick a = with.tick(offset), b = without.at(offset);
    ASSERT_EQ(std::memcmp(&a.command_force_n_in_world, &b.command_force_n_in_world, sizeof(Vec3)), 0) << i;
  }
}

TEST(MovingFrameCore, StopsTheBoxWhereThatIsTheRuleAndGoesOnWhenTheFrameIsBack) {
  MovingCore core(OnFrameLoss::stop);
  core.addFloor();
  core.rig.directive.engage = true;
  core.feeds = false;
  EXPECT_EQ(core.ticks(10, {0, 0, 0.01}).cause, Cause::frame_lost) << "no force before the first poses";
  core.feeds = true;
  core.ticks(700, {0, 0, 0.01});
  const Vec3 inside{0, 0, -0.005};
  for (int i = 0; i <= 100; ++i) core.tick({0, 0, 0.01 - 0.00015 * i});
  rt::Tick tick = core.ticks(300, inside);
  ASSERT_EQ(tick.mode, Mode::engaged);
  ASSERT_NEAR(tick.command_force_n_in_world.z, 1.5, 0.01);
  core.feeds = false;
  double before_n = tick.command_force_n_in_world.z;
  for (int i = 0; i < 600; ++i) {
    tick = core.tick(inside);
    // two ramps of 0.2 s at once
    ASSERT_LE(std::abs(tick.command_force_n_in_world.z - before_n), 2 * 1.5 / 200 + 1e-3) << i;
    before_n = tick.command_force_n_in_world.z;
  }
  EXPECT_EQ(tick.mode, Mode::holding);
  EXPECT_EQ(tick.cause, Cause::frame_lost);
  EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
  core.feeds = true;
  for (int i = 0; i < 3000; ++i) {
    tick = core.tick(inside);
    // a region that grows at 5 mm/s, and the ramp that follows engaging
    const double most_n =
        kStiffness * 0.005 * kPeriod_s + 1.5 * kPeriod_s / core.rig.directive.parameters.safety.engage_ramp_s;
    ASSERT_LE(std::abs(tick.command_force_n_in_world.z - before_n), most_n + 1e-6) << i;
    before_n = tick.command_force_n_in_world.z;
  }
  EXPECT_EQ(tick.mode, Mode::engaged);
  EXPECT_NEAR(before_n, 1.5, 0.01);
}

TEST(MovingFrameCore, IgnoresAFrameThatOnlyADisabledFixtureNeeds) {
  MovingCore core(OnFrameLoss::stop);
  core.addFloor();
  core.set->fixtures[0].enabled = false;
  ++core.set->generation;
  core.rig.directive.engage = true;
  core.feeds = false;
  EXPECT_EQ(core.ticks(700, {}).mode, Mode::engaged);
}

TEST(MovingFrameCore, DoesNotTakeTheWorkOfItsMotionForAnUnstableContact) {
  // 10 mm at 1 Hz under a hand at rest, for 20 s
  MovingCore core;
  core.place = {0, 0, -0.01};
  core.addFloor(1000);
  core.engageAt({});
  Vec3 before_n;
  for (int i = 0; i < 20'000; ++i) {
    core.place.z = 0.005 * (std::sin(2 * std::numbers::pi * i * kPeriod_s) - 1) + 0.003;
    const rt::Tick tick = core.tick({});
    ASSERT_EQ(tick.mode, Mode::engaged) << i << " " << static_cast<int>(tick.cause);
    const Vec3& force_n = tick.command_force_n_in_world;
    // a hand at rest: what the region may step its force by, and the damping of passivity control, which
    // moves with the hand's velocity alone
    ASSERT_LE(norm(force_n - before_n), 0.05 + 1e-3) << i;
    before_n = force_n;
  }
}

TEST(MovingFrameCore, LimitsThePowerThatAHandWhichGivesWayGets) {
  // the hand is pushed by the floor and yields without resistance of its own beyond its mass
  MovingCore core;
  core.place = {0, 0, -0.01};
  core.addFloor(1000);
  core.engageAt({});
  double z = 0, velocity = 0, got_j = 0;
  constexpr double kMass_kg = 0.3, kDamping_n_s_per_m = 20;
  for (int i = 0; i < 3000; ++i) {
    core.place.z = std::min(-0.01 + 3e-4 * i, 0.3);
    const double force_n = core.tick({0, 0, z}).command_force_n_in_world.z;
    velocity += (force_n - kDamping_n_s_per_m * velocity) / kMass_kg * kPeriod_s;
    z += velocity * kPeriod_s;
    got_j += force_n * velocity * kPeriod_s;
  }
  EXPECT_GT(z, 0.02) << "it is pushed along";
  EXPECT_LE(got_j, 0.1 * 3000 * kPeriod_s + 1e-3);
}

}  // namespace
}  // namespace hapticd::test
