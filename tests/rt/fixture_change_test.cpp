// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/rt/fixture_core.h"

// Fixtures that are moved or changed beside, around and under a hand.
namespace hapticd::test {
namespace {

using rt::FixtureKind;
using rt::Shape;
using rt::Vec3;

/// A hand of 100 g on a spring, which presses on the fixtures of a core.
class PressingHand {
 public:
  PressingHand(FixtureCore& core, const Vec3& anchor_m, const Vec3& place_m)
      : core_(core), anchor_(anchor_m), place_(place_m) {}

  rt::Tick move() {
    constexpr double kMass_kg = 0.1;
    const rt::Tick tick = core_.at(place_, velocity_);
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      const Vec3 force =
          tick.command_force_n_in_world - kStiffness * (place_ - anchor_) - kDamping * velocity_;
      velocity_ += (kPeriod_s / kSteps / kMass_kg) * force;
      place_ += (kPeriod_s / kSteps) * velocity_;
    }
    return tick;
  }
  rt::Tick moveFor(double time_s) {
    rt::Tick tick;
    fastest_m_per_s_ = 0;
    for (int i = 0; i < std::lround(time_s / kPeriod_s); ++i) {
      tick = move();
      fastest_m_per_s_ = std::max(fastest_m_per_s_, norm(velocity_));
    }
    return tick;
  }
  const Vec3& place() const { return place_; }
  double fastest_m_per_s() const { return fastest_m_per_s_; }
  double energy_j() const {
    return 0.5 * kStiffness * dot(place_ - anchor_, place_ - anchor_) + 0.05 * dot(velocity_, velocity_);
  }

 private:
  static constexpr double kStiffness = 60;
  static constexpr double kDamping = 2;

  FixtureCore& core_;
  Vec3 anchor_;
  Vec3 place_;
  Vec3 velocity_;
  double fastest_m_per_s_ = 0;
};

TEST(FixtureChange, ARegionThatIsMovedOverTheHandInManyStepsActsOnIt) {
  for (const int ticks_per_change : {1, 10, 33, 100}) {
    FixtureCore core;
    // nearer than the sphere, so that the latter's distance is not looked at in each tick
    Shape beside = floor();
    beside.axis_in_world = {1, 0, 0};
    beside.position_m_in_world = {-0.008, 0, 0};
    core.add(FixtureKind::plane, beside);
    rt::Fixture& ball = core.add(FixtureKind::sphere, sphere(0.03, {0, 0, 0.28}));
    ball.stiffness_n_per_m = 1000;
    ball.fade_in_s = 0;
    core.engage({});
    rt::Tick tick;
    for (int change = 0; change < 50; ++change) {
      ball.shape.position_m_in_world.z -= 0.005;
      core.redefine(ball);
      for (int i = 0; i < ticks_per_change; ++i) tick = core.at({});
    }
    // its boundary is 0 mm in front of the hand now; the next change is into it
    EXPECT_NEAR(norm(tick.command_force_n_in_world), 0, 1e-12);
    ball.shape.position_m_in_world.z -= 0.005;
    core.redefine(ball);
    double before_n = 0;
    for (int i = 0; i < 1500; ++i) {
      tick = core.at({});
      const double force_n = norm(tick.command_force_n_in_world);
      // and the first of these steps is blended in over 33 ms
      ASSERT_LE(force_n - before_n, 1000 * 0.005 * kPeriod_s * (1 + 1.0 / 33) + 1e-9) << "it grows by 5 mm/s";
      before_n = force_n;
    }
    EXPECT_NEAR(before_n, 4, 1e-6) << "the device's largest force, of 5 N";
    EXPECT_EQ(tick.fixtures_in_contact, 2U);
    EXPECT_LT(tick.command_force_n_in_world.z, 0);
  }
}

TEST(FixtureChange, HowFarARegionJumpsMakesNoDifferenceToTheHand) {
  // at once, by hops that go on from where the hand is held, and by one that is treated as a new region
  for (const double hop_m : {0.002, 0.018, 0.019, 0.025, 0.049, 0.051, 0.08}) {
    FixtureCore core;
    rt::Fixture& plane = core.add(FixtureKind::plane, floor(-0.2));
    plane.stiffness_n_per_m = 1000;
    plane.fade_in_s = 0;
    core.engage({});
    PressingHand hand(core, {0, 0, -0.01}, {0, 0, -0.01});
    hand.moveFor(0.1);
    plane.shape.position_m_in_world.z = core.origin.z;
    core.redefine(plane);
    hand.moveFor(4);
    for (int i = 0; i < 8; ++i) {
      plane.shape.position_m_in_world.z += (i % 2 == 0 ? 1 : -1) * hop_m;
      core.redefine(plane);
      hand.moveFor(0.5);
      if (i % 2 != 0) continue;
      // A mass on a spring whose end begins to move swings up to twice as fast.
      EXPECT_LT(hand.fastest_m_per_s(), 2 * 0.005) << hop_m << " m";
    }
  }
}

TEST(FixtureChange, AStifferRegionTakesTheHandThatPressesOnItOverSlowly) {
  FixtureCore core;
  rt::Fixture& plane = core.add(FixtureKind::plane, floor());
  plane.stiffness_n_per_m = 100;
  plane.max_force_n = 2;
  core.engage({0, 0, 0.002});
  PressingHand hand(core, {0, 0, -0.04}, {0, 0, 0.002});
  hand.moveFor(4);
  plane.stiffness_n_per_m = 5000;
  plane.max_force_n = 4;
  core.redefine(plane);
  hand.moveFor(5);
  EXPECT_LT(hand.fastest_m_per_s(), 2 * 0.005);
  const Vec3 resting = hand.place();
  for (int i = 0; i < 200; ++i) core.at({0, 0, resting.z + (0.001 - resting.z) * i / 199});
  rt::Tick tick;
  for (int i = 0; i < 200; ++i) tick = core.at({0, 0, 0.0002 - 0.000004 * i});
  EXPECT_NEAR(tick.fixture_force_n_in_world.z, 5000 * 0.000596, 0.05)
      << "it is stiff when the hand comes again";
}

}  // namespace
}  // namespace hapticd::test
