// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>

#include "tests/hard_cases/hard_rig.h"

// Friction and damping of the constraint laws, and their transitions.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

constexpr double kDistance_m = 1;

/// Half a raw unit of the fine camera is 0.13 mm.
constexpr double kRounding_n = 0.07;

class Table : public HardRig {
 public:
  explicit Table(rt::ForceLaw law) : HardRig(law, fineCameraFor(kDistance_m)) {
    TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m}, fineCameraFor(kDistance_m));
    show(plane);
    jumpTo(above(0.03));
    tick(hip());
  }
  static Vec3 above(double height_m, double x_m = 0.0003) { return {x_m, 0.0007, -kDistance_m + height_m}; }
};

TEST_P(EachConstraint, SlidesWithoutFrictionBehindTheHip) {
  Table table(GetParam());
  table.moveTo(Table::above(-0.01));
  const rt::Tick tick = table.moveTo(Table::above(-0.01, 0.0303), 0.0005);
  EXPECT_NEAR(tick.law_force_n_in_world.x, 0, 0.02);
  EXPECT_NEAR(tick.law_force_n_in_world.z, 5, kRounding_n);
}

TEST_P(EachConstraint, SticksUpToTheFrictionConeAndThenSlidesOnIt) {
  constexpr double kFriction = 0.4;
  Table table(GetParam());
  table.box.parameters().contact.friction = kFriction;
  table.moveTo(Table::above(-0.01));
  // Coulomb: up to a displacement of 0.4 * 10 mm the proxy sticks, and the tangential force is k times the
  // displacement
  for (int step = 0; step <= 30; ++step) {
    const double aside = step * 1e-4;
    const rt::Tick tick = table.moveTo(Table::above(-0.01, 0.0003 + aside));
    EXPECT_NEAR(tick.law_force_n_in_world.x, -500 * aside, 0.06) << aside;
    EXPECT_NEAR(tick.law_force_n_in_world.z, 5, kRounding_n);
  }
  // beyond that the proxy follows, and the force stays on the cone
  for (int step = 1; step <= 20; ++step) {
    const rt::Tick tick = table.moveTo(Table::above(-0.01, 0.0003 + 0.006 + step * 1e-3), 0.0005);
    EXPECT_NEAR(tick.law_force_n_in_world.x, -kFriction * tick.law_force_n_in_world.z, 0.06);
  }
}

TEST_P(EachConstraint, DampsAlongTheNormalAndNeverPulls) {
  Table table(GetParam());
  table.box.parameters().contact.damping_n_s_per_m = 4;
  table.moveTo(Table::above(-0.005));
  const double still = table.box.tick(Table::above(-0.005), kTick_s).law_force_n_in_world.z;
  EXPECT_NEAR(still, 2.5, kRounding_n);
  EXPECT_NEAR(table.box.tick(Table::above(-0.005), kTick_s, {0, 0, -0.1}).law_force_n_in_world.z, still + 0.4,
              1e-3);
  EXPECT_NEAR(table.box.tick(Table::above(-0.005), kTick_s, {0, 0, 0.1}).law_force_n_in_world.z, still - 0.4,
              1e-3);
  EXPECT_NEAR(table.box.tick(Table::above(-0.005), kTick_s, {0, 0, 5}).law_force_n_in_world.z, 0, 1e-6);
  EXPECT_NEAR(table.box.tick(Table::above(-0.005), kTick_s, {3, 3, 0}).law_force_n_in_world.z, still,
              0.01);  // the normal is within 0.1 degrees
}

TEST_P(EachConstraint, LeavesTheSurfaceWithoutSticking) {
  Table table(GetParam());
  table.moveTo(Table::above(-0.01));
  for (int step = 0; step <= 200; ++step) {
    const double height = -0.01 + step * 1e-4;
    const rt::Tick tick = table.moveTo(Table::above(height));
    ASSERT_NEAR(tick.law_force_n_in_world.z, std::max(0.0, -500 * height), kRounding_n) << height;
    if (height > 0.012) {
      ASSERT_EQ(tick.contact, rt::ContactState::free) << height;
      ASSERT_EQ(tick.proxy_m_in_world, table.hip()) << height;
    }
  }
}

TEST_P(EachConstraint, KeepsTheProxyWhenTheOtherConstraintLawTakesOver) {
  const rt::ForceLaw other = GetParam() == rt::ForceLaw::proxy ? rt::ForceLaw::surface : rt::ForceLaw::proxy;
  Table table(GetParam());
  table.moveTo(Table::above(-0.02));
  const auto no_fixtures = std::make_unique<rt::FixtureSet>();
  table.box.setAdditions(no_fixtures.get(), nullptr);
  table.tick(table.hip());
  table.box.parameters().law = other;
  rt::Tick tick;
  // It begins at 5 mm/s, while the force of the other one leaves.
  for (int i = 0; i < 4100; ++i) {
    tick = table.tick(table.hip());
    ASSERT_GT(tick.blended_force_n_in_world.z, 7.4) << "a quarter less at most, and not through the surface";
  }
  EXPECT_EQ(tick.law, other);
  EXPECT_NEAR(tick.law_force_n_in_world.z, 10, 0.1);
}

TEST_P(EachConstraint, HoldsAHiddenSurfaceAndReleasesItWhenTheHipLeaves) {
  TrueScene table_top({.kind = SceneKind::plane, .distance_m = 1});
  TrueScene arm({.kind = SceneKind::plane, .distance_m = 0.7});
  HardRig rig(GetParam());
  rig.show(table_top);
  rig.jumpTo({0, 0, -0.97});
  rig.tick(rig.hip());
  const double pressed = rig.moveTo({0, 0, -1.01}).law_force_n_in_world.z;
  ASSERT_GT(pressed, 3);
  rig.show(arm);
  rt::Tick tick;
  for (int i = 0; i < 100; ++i) tick = rig.tick(rig.hip());
  if (GetParam() == rt::ForceLaw::surface) {
    EXPECT_NEAR(tick.command_force_n_in_world.z, pressed, 0.05);
  }
  EXPECT_LE(tick.command_force_n_in_world.z, pressed + 0.05) << "the arm does not throw the handle";
  tick = rig.moveTo({0, 0, -0.9});
  for (int i = 0; i < 100; ++i) tick = rig.tick(rig.hip());
  EXPECT_EQ(tick.command_force_n_in_world, Vec3{}) << "there is no force behind what the camera sees";
}

}  // namespace
}  // namespace hapticd::test
