// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>

#include "config/settings/law_choice.h"
#include "tests/hard_cases/hard_rig.h"
#include "tests/rt/core_rig.h"
#include "tests/support/passive_hand.h"
#include "tests/support/sanitizer.h"
#include "tests/unit/rt/fixtures/random_fixtures.h"

// Fixtures, laws and stiffnesses that change while a passive hand presses on them, and forces that return
// after a pause: what begins anew begins at the hand, and what ends gives way slowly.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

/// A hand on a box, over a connection with a delay.
class PressedBox {
 public:
  PressedBox(RandomShapes& random, const Vec3& place, double delay_s)
      : random_(random), up_(delay_s / 2, 0, 0), down_(delay_s / 2, 0, 0) {
    rig.start.device_mass_kg = 0.045;
    rig.handle.delay_s = up_.longestDelay_s() + down_.longestDelay_s();
    rig.handle.position_m_in_world = place;
    rig.directive.engage = true;
    rig.steps(600);
    hand = {.mass_kg = logBetween(random, 0.045, 0.3),
            .stiffness_n_per_m = 60,
            .anchor_m = place,
            .place_m = place};
  }

  rt::Tick step() {
    up_.send(tick_, hand.place_m, hand.velocity_m_per_s, random_);
    const Connection::Packet& state = up_.received(tick_);
    rt::Tick tick;
    if (state.number >= 0) {
      rig.handle.position_m_in_world = state.first;
      rig.handle.velocity_m_per_s_in_world = state.second;
      tick = rig.step();
    }
    down_.send(tick_, tick.command_force_n_in_world, {}, random_);
    hand.move(down_.received(tick_++).first);
    return tick;
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }

  CoreRig rig;
  Hand hand{};

 private:
  RandomShapes& random_;
  Connection up_;
  Connection down_;
  int tick_ = 0;
};

/// What the hand got at most in some time, and how fast it became.
struct Kick {
  double speed_m_per_s = 0;
  double gained_j = 0;  ///< beyond what a region that grows at its largest speed gives
};
template <typename Pressed>
Kick kickDuring(Pressed& box, int ticks) {
  Kick kick;
  const double before_j = box.hand.energy_j();
  double growth_j = 0;
  for (int i = 0; i < ticks; ++i) {
    const rt::Tick tick = box.step();
    growth_j += norm(tick.command_force_n_in_world) * rt::kMaxGrowth_m_per_s * kHandTick_s;
    kick.speed_m_per_s = std::max(kick.speed_m_per_s, norm(box.hand.velocity_m_per_s));
    kick.gained_j = std::max(kick.gained_j, box.hand.energy_j() - before_j - growth_j);
  }
  return kick;
}

/// A forbidden region that holds and exerts no force at `at`.
rt::Fixture anyFixture(RandomShapes& random, const Vec3& at) {
  FixtureRig shapes;
  do {
    shapes.set->count = 0;
    addAny(shapes, random, {});
  } while (rt::isGuidance(shapes[0].kind) || shapes[0].effect == rt::FixtureEffect::slow);
  rt::Fixture fixture = shapes[0];
  fixture.shape.position_m_in_world += at;
  fixture.max_force_n = random.between(0.5, 4);
  fixture.stiffness_n_per_m = logBetween(random, 50, 2000);
  fixture.soft_stiffness_n_per_m = std::min(fixture.soft_stiffness_n_per_m, fixture.stiffness_n_per_m);
  fixture.fade_in_s = random.between(0, 0.5);
  return fixture;
}

class BeginAnew : public testing::TestWithParam<double> {};

/// 45 to 300 g, a spring of 60 N/m to a place 5 to 25 mm behind a boundary: the hand rests when the fixture
/// becomes another one under the same name.
TEST_P(BeginAnew, AChangeUnderThePressedHandDoesNotKickIt) {
  constexpr unsigned kHands = kMemoryOfSanitizer ? 10 : 500;
  constexpr int kChanges = 4;
  for (unsigned seed = 1; seed <= kHands; ++seed) {
    RandomShapes random(seed);
    const Vec3 place = CoreRig().wall.inFrontOfWall(0.3);
    auto set = std::make_unique<rt::FixtureSet>();
    PressedBox box(random, place, GetParam());
    box.rig.fixtures = set.get();
    rt::Fixture& fixture = set->fixtures[0];
    fixture = anyFixture(random, place);
    fixture.identity = 1;
    fixture.definition = set->generation = set->count = 1;
    box.steps(100);
    const rt::Fixture first = fixture;
    const Vec3 towards = random.direction();
    for (int i = 0; i < 100; ++i) {
      box.hand.anchor_m += 3e-4 * towards;
      box.steps(10);
    }
    box.steps(1500);
    for (int change = 0; change < kChanges; ++change) {
      const double what = random.between(0, 1);
      const rt::Fixture before = fixture;
      if (what < 0.3) {
        fixture = anyFixture(random, place);
      } else if (what < 0.5) {
        fixture.shape.position_m_in_world += random.place(0.1);
      } else if (what < 0.7) {
        fixture.stiffness_n_per_m *= logBetween(random, 0.1, 20);
        fixture.max_force_n *= logBetween(random, 0.2, 3);
      } else if (what < 0.8) {
        fixture.enabled = !fixture.enabled;
      } else if (what < 0.9) {
        fixture = first;  // undo, or a reload
      } else {
        set->count = 1 - set->count;
      }
      fixture.identity = 1;
      fixture.definition = before.definition + (what >= 0.7 && what < 0.8 ? 0 : 1);
      ++set->generation;
      const Kick kick = kickDuring(box, 800);
      const std::string where =
          fmt::format("hand {} of {:.0f} g, change {} ({:.2f})", seed, 1e3 * box.hand.mass_kg, change, what);
      // Where the delay limits the stiffness, what leaves and what comes get half of it each, at once.
      EXPECT_LE(kick.speed_m_per_s, GetParam() < 0.01 ? 0.05 : 0.08) << where;
      EXPECT_LE(kick.gained_j, 1e-3) << where;
    }
  }
}

/// One of the causes that hold a force at zero although the law could be evaluated.
struct Pause {
  const char* name;
  void (*begin)(CoreRig&);
  void (*end)(CoreRig&);
};
class ForceReturns : public testing::TestWithParam<Pause> {};

/// The hand presses, the force is held at zero for 1.5 s, and the hand goes to where it wants to be, 20 to 60
/// mm deep.
TEST_P(ForceReturns, WithoutAForceOverADepthThatWasReachedWithoutOne) {
  constexpr unsigned kHands = kMemoryOfSanitizer ? 5 : 60;
  for (unsigned seed = 1; seed <= kHands; ++seed) {
    RandomShapes random(seed);
    const Vec3 place = CoreRig().wall.inFrontOfWall(0.3);
    auto set = std::make_unique<rt::FixtureSet>();
    PressedBox box(random, place, 0.002);
    box.rig.fixtures = set.get();
    set->count = 1 + static_cast<std::uint32_t>(random.between(0, 15.99));
    set->generation = 1;
    for (std::uint32_t i = 0; i < set->count; ++i) {
      rt::Fixture& fixture = set->fixtures[i];
      fixture = anyFixture(random, place);
      fixture.identity = i + 1;
      fixture.definition = i + 1;
      fixture.fades_without_depth = true;
    }
    box.steps(200);
    const Vec3 way = random.between(0.02, 0.06) * random.direction();
    for (int i = 0; i < 1000; ++i) {
      box.hand.anchor_m = place + (i / 1000.0) * way;
      box.step();
    }
    box.steps(500);
    GetParam().begin(box.rig);
    rt::Tick tick;
    for (int i = 0; i < 1500; ++i) {
      box.hand.anchor_m = place + (1 + i / 1500.0) * way;
      tick = box.step();
    }
    ASSERT_EQ(tick.command_force_n_in_world, Vec3{}) << seed;
    GetParam().end(box.rig);
    const double before_j = box.hand.energy_j();
    double gained_j = 0;
    for (int i = 0; i < 3000; ++i) {
      tick = box.step();
      gained_j = std::max(gained_j, box.hand.energy_j() - before_j);
    }
    EXPECT_EQ(tick.mode, rt::Mode::engaged) << seed;
    EXPECT_LE(gained_j, 0.03) << "hand " << seed << " of " << box.hand.mass_kg << " kg, " << set->count
                              << " members";
  }
}

/// A hand on a wall that a camera sees, without fixtures.
class PressedWall {
 public:
  PressedWall(rt::ForceLaw law, RandomShapes& random)
      : scene_({.kind = SceneKind::plane, .distance_m = 1, .tilt_rad = random.between(-0.5, 0.5)},
               fineCameraFor(1)),
        rig(law, scene_.depthModel()) {
    const TrueScene::Approach approach = scene_.approach(0);
    surface_ = approach.surface_m_in_world;
    inward_ = approach.inward_in_world;
    rig.box.start().device_mass_kg = 0.045;
    rig.box.parameters().force.stiffness_n_per_m = logBetween(random, 200, 1000);
    rt::SafetyParameters& safety = rig.box.parameters().safety = {};
    safety.continuous_force_n = safety.max_force_n;
    rig.show(scene_);
    rig.box.setAdditions(set_.get(), nullptr);
    const Vec3 place = at(-0.04);
    hand = {.mass_kg = logBetween(random, 0.045, 0.3),
            .stiffness_n_per_m = 60,
            .anchor_m = place,
            .place_m = place};
    steps(600);
  }
  /// Behind the surface by `depth_m`.
  Vec3 at(double depth_m) const { return surface_ + depth_m * inward_; }
  rt::Tick step() {
    const rt::Tick tick = rig.box.tick(hand.place_m, kTick_s, hand.velocity_m_per_s);
    hand.move(tick.command_force_n_in_world);
    return tick;
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  void goTo(double depth_m, int ticks) {
    const Vec3 from = hand.anchor_m;
    for (int i = 1; i <= ticks; ++i) {
      hand.anchor_m = from + (static_cast<double>(i) / ticks) * (at(depth_m) - from);
      step();
    }
  }

 private:
  TrueScene scene_;
  Vec3 surface_;
  Vec3 inward_;
  std::unique_ptr<rt::FixtureSet> set_ = std::make_unique<rt::FixtureSet>();

 public:
  HardRig rig;
  Hand hand{};
};

rt::ForceLaw anyLaw(RandomShapes& random) {
  return rt::kForceLaws[static_cast<std::size_t>(random.between(0, rt::kForceLaws.size() - 1e-9))].law;
}

/// The hand rests on the live surface when another law, or another stiffness, takes effect.
TEST(LiveSurface, ChangesUnderThePressedHandWithoutAKick) {
  constexpr unsigned kHands = kMemoryOfSanitizer ? 10 : 200;
  for (unsigned seed = 1; seed <= kHands; ++seed) {
    RandomShapes random(seed);
    PressedWall wall(anyLaw(random), random);
    // Springs without a proxy begin ahead of the surface, and let a hand through that presses as hard as they
    // do.
    wall.goTo(random.between(0, 0.015), 1000);
    wall.steps(1500);
    for (int change = 0; change < 4; ++change) {
      rt::LiveParameters& parameters = wall.rig.box.parameters();
      const rt::ForceLaw before = parameters.law;
      if (random.between(0, 1) < 0.7) {
        parameters.law = anyLaw(random);
      } else {
        parameters.force.stiffness_n_per_m = logBetween(random, 200, 1000);
      }
      const Kick kick = kickDuring(wall, 3000);
      const std::string where = fmt::format(
          "hand {} of {:.0f} g, change {}, law {} to {}, {:.0f} N/m", seed, 1e3 * wall.hand.mass_kg, change,
          config::nameOf(before), config::nameOf(parameters.law), parameters.force.stiffness_n_per_m);
      EXPECT_LE(kick.speed_m_per_s, 0.05) << where;
      EXPECT_LE(kick.gained_j, 1e-3) << where;
    }
  }
}

/// The force is held at zero for 1.5 s while the hand presses, and the hand goes deep.
TEST(LiveSurface, ReturnsWhereTheHandIsOutOfIt) {
  constexpr unsigned kHands = kMemoryOfSanitizer ? 5 : 60;
  for (unsigned seed = 1; seed <= kHands; ++seed) {
    RandomShapes random(seed);
    const rt::ForceLaw law = rt::kForceLaws[seed % rt::kForceLaws.size()].law;
    PressedWall wall(law, random);
    rt::LiveParameters& parameters = wall.rig.box.parameters();
    // Springs without a proxy act ahead of the surface.
    const double free_m = -0.04;
    // Springs without a proxy end at their radius behind the surface, too.
    const double depth_m = random.between(0.01, hasProxy(law) ? 0.05 : 0.03);
    wall.goTo(0.02, 1000);
    wall.steps(500);
    const std::string where =
        fmt::format("hand {}, law {}, {:.0f} mm deep", seed, config::nameOf(law), 1e3 * depth_m);
    EXPECT_GT(norm(wall.step().command_force_n_in_world), 0.1) << where;
    const double workspace_m = std::exchange(parameters.safety.workspace_radius_m, 1e-6);
    wall.goTo(depth_m, 1500);
    ASSERT_EQ(wall.step().command_force_n_in_world, Vec3{}) << where;
    parameters.safety.workspace_radius_m = workspace_m;
    const double before_j = wall.hand.energy_j();
    rt::Tick tick;
    for (int i = 0; i < 2000; ++i) {
      tick = wall.step();
      ASSERT_EQ(tick.law_force_n_in_world, Vec3{}) << where << ", tick " << i;
      ASSERT_LE(wall.hand.energy_j() - before_j, 1e-6) << where;
    }
    EXPECT_EQ(tick.mode, rt::Mode::engaged) << where;
    wall.goTo(free_m, 1000);
    wall.steps(300);
    wall.goTo(0.02, 1000);
    wall.steps(500);
    EXPECT_GT(norm(wall.step().command_force_n_in_world), 0.1) << where;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Causes, ForceReturns,
    testing::Values(Pause{"DepthStale", [](CoreRig& rig) { rig.scene_fresh = false; },
                          [](CoreRig& rig) { rig.scene_fresh = true; }},
                    Pause{"OverrunBurst", [](CoreRig& rig) { rig.overran = true; },
                          [](CoreRig& rig) { rig.overran = false; }},
                    Pause{"OutsideWorkspace",
                          [](CoreRig& rig) { rig.directive.parameters.safety.workspace_radius_m = 0; },
                          [](CoreRig& rig) { rig.directive.parameters.safety.workspace_radius_m = 10; }},
                    Pause{"HandleStale", [](CoreRig& rig) { rig.handle_fresh = false; },
                          [](CoreRig& rig) { rig.handle_fresh = true; }},
                    Pause{"Clutched",
                          [](CoreRig& rig) { rig.handle.condition = rt::HandleCondition::clutched; },
                          [](CoreRig& rig) { rig.handle.condition = rt::HandleCondition::ready; }}),
    [](const auto& pause) { return pause.param.name; });

/// 1 to 16 planes of one frame in front of a hand: the frame jumps, comes in bursts, moves and stops.
TEST(MovingFrames, OfManyMembersGiveAHandNoMoreThanTheirPower) {
  constexpr unsigned kRuns = kMemoryOfSanitizer ? 5 : 200;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    RandomShapes random(seed);
    FixtureRig rig;
    const int members = 1 + static_cast<int>(random.between(0, 15.99));
    for (int i = 0; i < members; ++i) {
      rt::Shape plane{.kind = rt::ShapeKind::plane, .position_m_in_world = {0, 0, random.between(-0.02, 0)}};
      plane.axis_in_world = {random.between(-0.5, 0.5), random.between(-0.5, 0.5), 1};
      plane.axis_in_world = (1 / norm(plane.axis_in_world)) * plane.axis_in_world;
      rt::Fixture& fixture = rig[rig.add(rt::FixtureKind::plane, plane, logBetween(random, 50, 3000))];
      fixture.frame = 0;
      fixture.max_force_n = random.between(0.5, 4);
    }
    rig.frames = {{}};
    rig.frames[0].share = 1;
    const Vec3 hip{0, 0, 0.005};
    rig.jumpTo(hip);
    double speed = 0;
    Vec3 before;
    for (int i = 0; i < 3000; ++i) {
      if (random.between(0, 1) < 0.005) speed = random.between(-0.5, 0.5);
      double& z = rig.frames[0].T_world_frame.position_m_in_world.z;
      z = random.between(0, 1) < 0.002 ? random.between(-0.02, 0.04)
                                       : std::clamp(z + speed * kHandTick_s, -0.03, 0.05);
      const rt::FixtureForces::Output output = rig.tick(hip);
      ASSERT_LE(output.changes_j, 0.1 * kHandTick_s + 1e-9)
          << "run " << seed << ", " << members << " members, tick " << i;
      ASSERT_LE(norm(output.spring_force_n - before), 0.05 + 1e-6)
          << "run " << seed << ", " << members << " members, tick " << i;
      before = output.spring_force_n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Delay, BeginAnew, testing::Values(0, 0.002, 0.01), [](const auto& delay) {
  return fmt::format("{}ms", std::lround(delay.param * 1e3));
});

}  // namespace
}  // namespace hapticd::test
