// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <random>

#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::FixtureKind;
using rt::Shape;
using rt::Vec3;

// Fixtures in the whole tick: changes while the HIP is inside, energy, the stiffness limit, engaging.

constexpr double kStiffness = FixtureCore::kStiffness;

TEST(FixtureCore, AnEmptySetChangesNoBit) {
  FixtureCore with;
  CoreRig without;
  without.directive.parameters = with.rig.directive.parameters;
  without.directive.engage = with.rig.directive.engage = true;
  for (int i = 0; i < 800; ++i) {
    const Vec3 place = with.rig.wall.inFrontOfWall(0.03 - 0.0001 * (i % 300));
    without.handle.position_m_in_world = with.rig.handle.position_m_in_world = place;
    const rt::Tick a = with.rig.step();
    const rt::Tick b = without.step();
    ASSERT_EQ(std::memcmp(&a.command_force_n_in_world, &b.command_force_n_in_world, sizeof(Vec3)), 0) << i;
  }
}

/// Asserts that the commanded force never changes by more than the blend allows while `change` is applied
/// with the HIP resting at `offset`.
void expectNoStep(FixtureCore& core, const Vec3& offset, const std::function<void()>& change) {
  core.engage(offset);
  Vec3 before = core.at(offset).command_force_n_in_world;
  change();
  // the blend's fastest surface, 0.5 m/s, on law and fixture together
  const double most_n = (1000 + 2 * kStiffness) * 0.5 * kPeriod_s;
  for (int i = 0; i < 2000; ++i) {
    const rt::Tick tick = core.at(offset);
    ASSERT_LE(norm(tick.command_force_n_in_world - before), most_n + 1e-9) << "tick " << i;
    before = tick.command_force_n_in_world;
  }
}

TEST(FixtureCore, DisablingRemovingChangingAndEnablingInsideNeverStepsTheForce) {
  const Vec3 inside{0, 0, -0.006};
  {
    FixtureCore core;
    rt::Fixture& plane = core.add(FixtureKind::plane, floor(-0.1));
    core.engage({});
    plane.shape.position_m_in_world = core.origin;
    core.redefine(plane);
    expectNoStep(core, inside, [&] {
      plane.enabled = false;
      ++core.set->generation;
    });
    expectNoStep(core, inside, [&] {
      plane.enabled = true;
      ++core.set->generation;
    });
    expectNoStep(core, inside, [&] {
      plane.shape.position_m_in_world.z += 0.004;
      core.redefine(plane);
    });
    expectNoStep(core, inside, [&] {
      plane.stiffness_n_per_m *= 2;
      core.redefine(plane);
    });
    expectNoStep(core, inside, [&] {
      core.set->count = 0;
      ++core.set->generation;
    });
    EXPECT_EQ(core.at(inside).command_force_n_in_world, Vec3{});
  }
}

/// Energy that the hand got more than it gave in each of many random closed loops through overlapping
/// fixtures of different stiffness, less what a device without a person dissipates by itself.
TEST(FixtureCore, NoClosedLoopOfTheHandGainsEnergy) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    FixtureCore core;
    core.add(FixtureKind::sphere, sphere(0.03, {0.01, 0, 0})).stiffness_n_per_m = 200;
    core.add(FixtureKind::sphere, sphere(0.03, {-0.02, 0.015, 0})).stiffness_n_per_m = 900;
    core.add(FixtureKind::plane, floor(-0.005)).stiffness_n_per_m = 500;
    core.engage({0, 0, 0.06});
    const double device_damping = core.rig.start.handle.device_damping_n_s_per_m;
    const Vec3 centre{0.02 * unit(engine), 0.02 * unit(engine), 0.012};
    const double phase = unit(engine);
    const auto placeAt = [&](double turn) {
      const double angle = 2 * M_PI * turn;
      return centre + Vec3{0.025 * std::sin(angle), 0.02 * std::cos(angle + phase), 0.02 * std::cos(angle)};
    };
    const Vec3 start = placeAt(0);
    for (int i = 1; i <= 300; ++i) core.at(Vec3{0, 0, 0.06} + (i / 300.0) * (start - Vec3{0, 0, 0.06}));
    double gained_j = 0;
    Vec3 force = core.at(start).command_force_n_in_world;
    double worst_j = -1;
    constexpr int kTicksPerLoop = 1500;
    Vec3 before = start;
    for (int tick = 1; tick <= 8 * kTicksPerLoop; ++tick) {
      const Vec3 place = placeAt(static_cast<double>(tick) / kTicksPerLoop);
      const Vec3 moved = place - before;
      gained_j += dot(force, moved) - device_damping * dot(moved, moved) / kPeriod_s;
      before = place;
      force = core.at(place).command_force_n_in_world;
      if (tick % kTicksPerLoop == 0 && tick > kTicksPerLoop) worst_j = std::max(worst_j, gained_j);
    }
    // the loops after the first, which stores energy in the springs, and has it back at the same place
    EXPECT_LE(worst_j, 2e-5) << "seed " << seed;
  }
}

TEST(FixtureCore, EngagingInsideAForbiddenRegionIsRefused) {
  FixtureCore core;
  core.rig.directive.engage_inside = false;
  core.add(FixtureKind::plane, floor());
  core.at({0, 0, 0.01});
  for (int i = 0; i < 20; ++i) core.at({0, 0, 0.01 - 0.001 * i});
  core.rig.directive.engage = true;
  const rt::Tick tick = core.at({0, 0, -0.01});
  EXPECT_EQ(tick.mode, rt::Mode::idle);
  EXPECT_EQ(tick.cause, rt::Cause::inside_surface);
}

/// The share of its configured stiffness with which fixture 0 acts, after the HIP has been 1 mm deep in it
/// for two seconds.
double shareOfFirst(FixtureCore& core) {
  core.engage({0, 0, 0.002});
  for (int i = 0; i < 2000; ++i) core.at({0, 0, -0.001});
  return core.rig.core.memory().state.fixtures.memory().fixtures[0].region.spring().stiffness_n_per_m /
         core.set->fixtures[0].stiffness_n_per_m;
}

TEST(FixtureCore, TheStiffnessLimitCountsWhatActsHereAlongOneNormal) {
  const auto shareWith = [](int planes, double stiffness_n_per_m,
                            const std::function<void(FixtureCore&)>& more) {
    FixtureCore core;
    core.rig.handle.delay_s = 0.004;
    for (int i = 0; i < planes; ++i)
      core.add(FixtureKind::plane, floor(-1e-5 * i)).stiffness_n_per_m = stiffness_n_per_m;
    more(core);
    return shareOfFirst(core);
  };
  const auto nothing = [](FixtureCore&) {};
  constexpr double kSoft = 300;
  EXPECT_EQ(shareWith(1, kSoft, nothing), 1);
  const double limit = 5000 * shareWith(1, 5000, nothing);
  ASSERT_LT(limit, 1000);
  ASSERT_GT(limit, 2 * kSoft);
  EXPECT_NEAR(shareWith(3, kSoft, nothing), limit / (3 * kSoft), 1e-6) << "three along one normal";
  EXPECT_NEAR(shareWith(3, 5000, nothing), limit / (3 * 5000), 1e-6);
  EXPECT_EQ(shareWith(1, kSoft,
                      [](FixtureCore& core) {
                        Shape wall = floor();
                        wall.axis_in_world = {1, 0, 0};
                        wall.position_m_in_world = {0.001, 0, 0};
                        core.add(FixtureKind::plane, wall).stiffness_n_per_m = 600;
                      }),
            1)
      << "one across it adds nothing";
  EXPECT_EQ(shareWith(1, kSoft,
                      [](FixtureCore& core) {
                        for (int i = 0; i < 4; ++i)
                          core.add(FixtureKind::sphere, sphere(0.03, {0, 0, -0.04})).stiffness_n_per_m = 5000;
                      }),
            1)
      << "nor do those that the HIP is not near";
}

TEST(FixtureCore, TheStiffnessLimitNeverTakesAwayTheLargestForce) {
  for (const double stiffness : {100.0, 1000.0, 5000.0}) {
    FixtureCore core;
    core.rig.handle.delay_s = 0.01;
    rt::Fixture& plane = core.add(FixtureKind::plane, floor());
    plane.stiffness_n_per_m = stiffness;
    plane.max_force_n = 4;
    core.engage({0, 0, 0.002});
    rt::Tick tick;
    for (int i = 0; i < 400; ++i) tick = core.at({0, 0, -0.0002 * i});
    EXPECT_NEAR(tick.command_force_n_in_world.z, 4, 1e-9) << stiffness << " N/m";
    EXPECT_NEAR(tick.fixture_force_n_in_world.z, 4, 1e-9) << "what is reported is what is exerted";
  }
}

TEST(FixtureCore, TheTickSaysWhatFixturesDo) {
  FixtureCore core;
  core.add(FixtureKind::sphere, sphere(0.02));
  core.engage({0, 0, 0.05});
  rt::Tick tick = core.at({0, 0, 0.05});
  EXPECT_EQ(tick.fixture_generation, core.set->generation);
  EXPECT_EQ(tick.nearest_fixture, 0);
  EXPECT_NEAR(tick.fixture_distance_m, 0.03, 1e-9);
  EXPECT_EQ(tick.fixtures_in_contact, 0U);
  EXPECT_EQ(tick.fixture_proxy_m_in_world, tick.hip_m_in_world);
  for (int i = 0; i < 50; ++i) tick = core.at({0, 0, 0.05 - 0.0007 * i});
  EXPECT_EQ(tick.fixtures_in_contact, 1U);
  EXPECT_NEAR(tick.fixture_distance_m, 0.05 - 0.0007 * 49 - 0.02, 1e-9);
  EXPECT_NEAR(norm(tick.fixture_proxy_m_in_world - core.origin), 0.02, 1e-9);
  EXPECT_GT(tick.fixture_force_n_in_world.z, 0);
  EXPECT_GT(tick.command_force_n_in_world.z, 0);
}

TEST(FixtureCore, ACoreRestoredFromMemoryGoesOnWithTheSameBits) {
  FixtureCore core;
  core.add(FixtureKind::sphere, sphere(0.02));
  core.engage({0, 0, 0.03});
  for (int i = 0; i < 20; ++i) core.at({0.0002 * i, 0, 0.03 - 0.0008 * i});
  const rt::HapticCore::Memory memory = core.rig.core.memory();
  const rt::Tick once = core.at({0.005, 0, 0.013});
  core.rig.core.restore(memory);
  core.rig.now_ns -= kPeriod_ns;
  core.rig.handle.position_m_in_world = core.origin + Vec3{0.0038, 0, 0.0148};
  const rt::Tick again = core.at({0.005, 0, 0.013});
  EXPECT_EQ(std::memcmp(&once.fixture_force_n_in_world, &again.fixture_force_n_in_world, sizeof(Vec3)), 0);
  EXPECT_EQ(std::memcmp(&once.command_force_n_in_world, &again.command_force_n_in_world, sizeof(Vec3)), 0);
}

/// Changing a soft layer under a pressing hand steps the force no more than any other change.
TEST(FixtureCore, ChangingTheSoftLayerInsideNeverStepsTheForce) {
  FixtureCore core;
  rt::Fixture& plane = core.add(FixtureKind::plane, floor(-0.1));
  core.engage({});
  plane.shape.position_m_in_world = core.origin;
  plane.soft_m = plane.clearance_m = 0.004;
  plane.soft_stiffness_n_per_m = 60;
  core.redefine(plane);
  const Vec3 inside{0, 0, -0.003};
  for (const double soft_m : {0.0, 0.01, 0.002}) {
    expectNoStep(core, inside, [&] {
      plane.soft_m = plane.clearance_m = soft_m;
      core.redefine(plane);
    });
  }
}

/// A viscous medium: it opposes the motion, is no contact that engaging would be refused for, and rests with
/// the hand.
TEST(FixtureCore, SlowsTheHandWithoutBeingContact) {
  FixtureCore core;
  core.rig.directive.engage_inside = false;
  rt::Fixture& zone = core.add(FixtureKind::sphere, sphere(0.1));
  zone.effect = rt::FixtureEffect::slow;
  zone.viscosity_n_s_per_m = 2;
  core.redefine(zone);
  core.engage({});
  rt::Tick tick = core.at({});
  ASSERT_EQ(tick.mode, rt::Mode::engaged);
  EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
  EXPECT_EQ(tick.fixtures_in_contact, 0U);
  constexpr double kSpeed = 0.1;
  double most_n = 0;
  for (int i = 1; i <= 300; ++i) {
    tick = core.at({0, i * kSpeed * kPeriod_s, 0});
    ASSERT_LE(tick.command_force_n_in_world.y, 0);
    ASSERT_LE(norm(tick.command_force_n_in_world), 2 * kSpeed * (1 + 1e-9));
    most_n = std::max(most_n, norm(tick.command_force_n_in_world));
    if (i == 50) {
      EXPECT_EQ(tick.fixtures_in_contact, 1U);
      EXPECT_NEAR(tick.fixture_force_n_in_world.y, -2 * kSpeed, 1e-9);
      EXPECT_EQ(core.rig.core.fixture(0).stage, rt::FixtureStage::contact);
    }
  }
  EXPECT_NEAR(most_n, 2 * kSpeed, 1e-3) << "after the low-pass and the slew limit";
  tick = core.at({0, 300 * kSpeed * kPeriod_s, 0});
  EXPECT_EQ(tick.fixture_force_n_in_world, Vec3{}) << "the hand rests";
  EXPECT_EQ(tick.fixtures_in_contact, 0U);
}

TEST(FixtureCore, ABreachHasTheForceThatWasExertedAndNoneWhileDisengaged) {
  for (const bool engaged : {false, true}) {
    FixtureCore core;
    core.add(FixtureKind::plane, floor());
    if (engaged) core.engage({0, 0, 0.02});
    for (int i = 0; i <= 240; ++i) core.at({0, 0, 0.02 - 0.0001 * i});
    for (int i = 0; i <= 240; ++i) core.at({0, 0, -0.004 + 0.0001 * i});
    for (int i = 0; i < 600; ++i) core.at({0, 0, 0.02});
    const rt::Breach breach = core.rig.core.fixture(0).breach;
    EXPECT_EQ(breach.number, 1U);
    EXPECT_NEAR(breach.depth_m, 0.004, 1e-9);
    EXPECT_NEAR(breach.entry_m_per_s, 0.1, 1e-6);
    if (engaged) {
      EXPECT_GE(breach.force_n, kStiffness * 0.004 - 1e-9);
    } else {
      EXPECT_EQ(breach.force_n, 0);
    }
  }
}

// Fixtures that are moved or changed beside, around and under a hand.

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
