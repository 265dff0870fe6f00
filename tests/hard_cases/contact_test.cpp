// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/force_blend.h"
#include "tests/hard_cases/hard_rig.h"

namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

// Friction and damping of the constraint laws, and their transitions.

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

// Surfaces that move between frames.

/// Returns the position of a HIP that trembles by 0.5 mm on three axes at about 8 Hz.
Vec3 trembling(const Vec3& place, double t_s) {
  constexpr double kAmplitude_m = 0.0005;
  return place + Vec3{kAmplitude_m * std::sin(50.3 * t_s), kAmplitude_m * std::sin(47.1 * t_s),
                      kAmplitude_m * std::sin(51.7 * t_s)};
}

struct MovingCase {
  double speed_m_per_s;
  bool pressed;  ///< the HIP rests on the surface before it moves; otherwise it is 30 mm in front
  bool trembles;
};

void expectSurfacePushes(rt::ForceLaw law, const MovingCase& moving) {
  SCOPED_TRACE(testing::Message() << moving.speed_m_per_s << " m/s, pressed " << moving.pressed
                                  << ", trembling " << moving.trembles);
  TrueScene still({.kind = SceneKind::plane, .distance_m = kDistance_m}, fineCameraFor(kDistance_m));
  TrueScene plane(
      {.kind = SceneKind::plane, .distance_m = kDistance_m, .speed_m_per_s = moving.speed_m_per_s},
      fineCameraFor(kDistance_m));
  HardRig rig(law, plane.depthModel());
  rig.show(still);
  const Vec3 place{0.0003, 0.0007, -kDistance_m + (moving.pressed ? -0.0105 : 0.03)};
  rig.jumpTo({0.0003, 0.0007, -kDistance_m + 0.03});
  rig.tick(rig.hip());
  rig.moveTo(place, 0.0005);
  const double travel_m = moving.pressed ? 0.06 : 0.09;
  const int ticks = static_cast<int>(travel_m / moving.speed_m_per_s / kTick_s);
  rt::Tick last;
  double shown_m = 0;
  for (int i = 0; i <= ticks; ++i) {
    if (i % kTicksPerFrame == 0) {
      shown_m = moving.speed_m_per_s * i * kTick_s;
      rig.show(plane, i * kTick_s);
    }
    const Vec3 hip = moving.trembles ? trembling(place, i * kTick_s) : place;
    last = rig.tick(hip);
    const double surface_z = -kDistance_m + shown_m;
    // never behind the most recently shown surface
    ASSERT_GE(last.proxy_m_in_world.z, surface_z - 5e-4) << "tick " << i;
    const double depth = surface_z - hip.z;
    // the force corresponds to the depth below the most recently shown surface
    ASSERT_NEAR(last.law_force_n_in_world.z, std::max(0.0, depth) * rig.stiffness_n_per_m(), 0.15)
        << "tick " << i;
  }
  EXPECT_GT(last.law_force_n_in_world.z, 0.8 * 0.06 * rig.stiffness_n_per_m());
}

TEST_P(EachConstraint, AMovingSurfaceNeverPassesThroughTheProxy) {
  for (const double speed : {0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5}) {
    for (const bool pressed : {false, true}) {
      for (const bool trembles : {false, true}) expectSurfacePushes(GetParam(), {speed, pressed, trembles});
    }
  }
}

TEST_P(EachConstraint, AMovingSurfaceWithTheSensorsNoiseNeverPassesThroughTheProxy) {
  for (const double speed : {0.05, 0.3, 0.5}) {
    TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m, .speed_m_per_s = speed});
    HardRig rig(GetParam(), plane.depthModel());
    const Vec3 hip{0.0003, 0.0007, -kDistance_m + 0.03};
    const int ticks = static_cast<int>(0.09 / speed / kTick_s);
    rt::Tick last;
    for (int i = 0; i <= ticks; ++i) {
      if (i % kTicksPerFrame == 0) rig.show(plane, i * kTick_s, tools::SceneNoise::sensor);
      last = rig.tick(hip);
    }
    // the last frame is up to 33 ms old; 3 standard deviations of the noise are 1.7 mm
    EXPECT_GT(last.law_force_n_in_world.z, (0.06 - speed * kFrame_s - 0.005) * rig.stiffness_n_per_m())
        << speed;
  }
}

TEST_P(EachLaw, AFrameThatJumpsBy10MillimetresIsBlendedAtTheSurfacesTopSpeed) {
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m, .speed_m_per_s = 0.01 / kFrame_s},
                  fineCameraFor(kDistance_m));
  for (const bool towards : {true, false}) {
    HardRig rig(GetParam(), plane.depthModel());
    rig.show(plane, towards ? 0 : kFrame_s);
    rig.jumpTo({0.0003, 0.0007, -kDistance_m + 0.04});
    // in front of the surface for the springs, below it for the laws with a proxy
    const Vec3 hip{0.0003, 0.0007, -kDistance_m + (rt::hasProxy(GetParam()) ? -0.005 : 0.025)};
    rig.moveTo(hip);
    for (int i = 0; i < 100; ++i) rig.tick(hip);
    Vec3 before = rig.tick(hip).command_force_n_in_world;
    rig.show(plane, towards ? kFrame_s : 0);
    const double max_n = rig.stiffness_n_per_m() * rt::kFastestSurface_m_per_s * kTick_s;
    for (int i = 0; i < 40; ++i) {
      const rt::Tick tick = rig.tick(hip);
      ASSERT_LE(norm(tick.command_force_n_in_world - before), max_n + 1e-9) << "tick " << i;
      before = tick.command_force_n_in_world;
      // complete within a frame and the tick in which the frame arrived
      if (i > kTicksPerFrame + 2) {
        ASSERT_LE(norm(before - tick.law_force_n_in_world), 1e-9) << "tick " << i;
      }
    }
  }
}

TEST_P(EachConstraint, TheWorkOfAMovingSurfaceIsBoundedByForceTimesItsTopSpeed) {
  // the HIP is still; the spring's energy F^2 / 2k may grow by F v_max T per tick, and F dF / k is its growth
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m, .speed_m_per_s = 2},
                  fineCameraFor(kDistance_m));  // faster than allowed
  HardRig rig(GetParam(), plane.depthModel());
  const Vec3 hip{0, 0, -kDistance_m + 0.01};
  double before = 0;
  for (int i = 0; i <= 60; ++i) {
    if (i % kTicksPerFrame == 0) rig.show(plane, i / kTicksPerFrame * 0.015);  // 30 mm per frame
    const double force = norm(rig.tick(hip).command_force_n_in_world);
    const double work_j = (force * force - before * before) / (2 * rig.stiffness_n_per_m());
    ASSERT_LE(work_j, std::max(force, before) * rt::kFastestSurface_m_per_s * kTick_s + 1e-12)
        << "tick " << i;
    before = force;
  }
  EXPECT_GT(before, 5);
}

TEST_P(EachConstraint, AnObjectThatAppearsAroundTheHipPushesItOutOrLeavesItAlone) {
  for (const double depth_m : {0.005, 0.01, 0.02, 0.03, 0.1, 0.4}) {
    TrueScene wall({.kind = SceneKind::plane, .distance_m = kDistance_m});
    HardRig rig(GetParam(), wall.depthModel());
    rig.showConstant(drivers::kKinectNoMeasurement);
    const Vec3 hip{0, 0, -kDistance_m - depth_m};
    for (int i = 0; i < 40; ++i) rig.tick(hip);
    rig.show(wall);
    double before = 0;
    for (int i = 0; i < 200; ++i) {
      const rt::Tick tick = rig.tick(hip);
      ASSERT_TRUE(isFinite(tick.command_force_n_in_world));
      ASSERT_GE(tick.command_force_n_in_world.z, 0);
      ASSERT_LE(std::abs(tick.command_force_n_in_world.z - before), 0.25 + 1e-9) << "tick " << i;
      before = tick.command_force_n_in_world.z;
    }
    // up to 35 mm it may be a surface that moved; the sensor's rounding is 1.5 mm, which is 0.77 N of spring
    // force
    if (depth_m <= 0.03) {
      EXPECT_NEAR(before, depth_m * rig.stiffness_n_per_m(), 0.8) << depth_m;
    }
    if (depth_m >= 0.1) {
      EXPECT_EQ(before, 0) << depth_m;
    }
  }
}

TEST_P(EachLaw, NoFrameLawOrParameterChangeStepsTheForce) {
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m}, {});
  HardRig rig(GetParam(), plane.depthModel());
  rig.show(plane, 0, tools::SceneNoise::sensor);
  const Vec3 hip{0, 0, -kDistance_m + 0.01};
  rig.jumpTo({0, 0, -kDistance_m + 0.06});
  rig.moveTo(hip);
  Vec3 before = rig.tick(hip).command_force_n_in_world;
  for (int i = 0; i < 2000; ++i) {
    if (i % kTicksPerFrame == 0) rig.show(plane, 0, tools::SceneNoise::sensor);
    if (i % 170 == 0) {
      const int next = (static_cast<int>(rig.box.parameters().law) + 1) % 4;
      rig.box.parameters().law = static_cast<rt::ForceLaw>(next);
    }
    if (i % 230 == 0) rig.box.parameters().force.stiffness_n_per_m = 300 + (i * 7) % 400;
    const rt::Tick tick = rig.tick(hip);
    const double max_n = 700 * rt::kFastestSurface_m_per_s * kTick_s;
    ASSERT_LE(norm(tick.command_force_n_in_world - before), max_n + 1e-9) << "tick " << i;
    before = tick.command_force_n_in_world;
  }
}

}  // namespace
}  // namespace hapticd::test
