// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/rt/fixture_rig.h"

// Forbidden-region fixtures against closed forms, and pushes that must not get through.
namespace hapticd::test {
namespace {

using rt::FixtureKind;
using rt::FixtureSide;
using rt::Shape;
using rt::ShapeKind;
using rt::Vec3;

constexpr int kPlaces = 10'000;
constexpr double kStiffness = 300;

/// A boundary point of a shape with its outward normal, and how deep inside it stays the nearest one.
struct BoundaryPoint {
  Vec3 place;
  Vec3 outward;
  double most_depth_m;
};

Vec3 times(const std::array<double, 9>& r, const Vec3& v) {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}
Vec3 across(const Vec3& axis, RandomShapes& random) {
  const Vec3 side = cross(axis, random.direction());
  return norm(side) > 0.01 ? (1 / norm(side)) * side : across(axis, random);
}

BoundaryPoint onPlane(Shape& plane, RandomShapes& random) {
  plane = {.kind = ShapeKind::plane,
           .position_m_in_world = random.place(0.2),
           .axis_in_world = random.direction()};
  return {plane.position_m_in_world + random.between(0, 0.3) * across(plane.axis_in_world, random),
          plane.axis_in_world, 0.05};
}
BoundaryPoint onSphere(Shape& sphere, RandomShapes& random) {
  sphere = {.kind = ShapeKind::sphere, .position_m_in_world = random.place(0.2)};
  sphere.radius_m = random.between(0.005, 0.2);
  const Vec3 outward = random.direction();
  return {sphere.position_m_in_world + sphere.radius_m * outward, outward, 0.6 * sphere.radius_m};
}
BoundaryPoint onBox(Shape& box, RandomShapes& random) {
  box = {.kind = ShapeKind::box, .position_m_in_world = random.place(0.2)};
  box.rotation = random.rotation();
  box.half_size_m = {random.between(0.005, 0.1), random.between(0.005, 0.1), random.between(0.005, 0.1)};
  // on the face to +x, where the other faces are farther than the depth
  const Vec3& h = box.half_size_m;
  const double least = std::min({h.x, h.y, h.z});
  const double depth = 0.4 * least;
  const Vec3 local{h.x, random.between(-1, 1) * (h.y - depth), random.between(-1, 1) * (h.z - depth)};
  return {box.position_m_in_world + times(box.rotation, local), times(box.rotation, {1, 0, 0}), depth};
}
BoundaryPoint onCapsule(Shape& capsule, RandomShapes& random) {
  capsule = {.kind = ShapeKind::capsule,
             .position_m_in_world = random.place(0.2),
             .axis_in_world = random.direction()};
  capsule.length_m = random.between(0, 0.2);
  capsule.radius_m = random.between(0.005, 0.1);
  const Vec3 outward = across(capsule.axis_in_world, random);
  return {capsule.position_m_in_world + random.between(0, capsule.length_m) * capsule.axis_in_world +
              capsule.radius_m * outward,
          outward, 0.6 * capsule.radius_m};
}
BoundaryPoint onCone(Shape& cone, RandomShapes& random) {
  cone = {
      .kind = ShapeKind::cone, .position_m_in_world = random.place(0.2), .axis_in_world = random.direction()};
  const double half_angle = random.between(0.2, 1.3);
  cone.half_angle_sine = std::sin(half_angle);
  cone.half_angle_cosine = std::cos(half_angle);
  const Vec3 radial = across(cone.axis_in_world, random);
  const double along = random.between(0.05, 0.3);
  const Vec3 side = cone.half_angle_cosine * cone.axis_in_world + cone.half_angle_sine * radial;
  const Vec3 outward = cone.half_angle_cosine * radial - cone.half_angle_sine * cone.axis_in_world;
  return {cone.position_m_in_world + along * side, outward, 0.4 * along * std::tan(half_angle)};
}

struct KindOfShape {
  const char* name;
  FixtureKind kind;
  BoundaryPoint (*make)(Shape&, RandomShapes&);
};
class EachShape : public testing::TestWithParam<KindOfShape> {};

/// Moves the HIP from in front of a boundary point straight into the region, off the perpendicular on the
/// way, and compares with the spring to that point.
void expectClosedForm(const KindOfShape& kind, FixtureSide side, unsigned seed) {
  RandomShapes random(seed);
  for (int i = 0; i < kPlaces; ++i) {
    FixtureRig rig;
    Shape shape;
    const BoundaryPoint point = kind.make(shape, random);
    const bool keeps_in = side == FixtureSide::in;
    const Vec3 free = keeps_in ? -point.outward : point.outward;
    rig[rig.add(kind.kind, shape, kStiffness)].side = side;
    // outside a solid to keep in there is room for any depth where its boundary is flat or curved inwards
    const double depth = random.between(0.02, 1) * std::min(point.most_depth_m, 0.03);
    const Vec3 hip = point.place - depth * free;
    rig.jumpTo(point.place + 0.001 * free);
    rig.tick(point.place - 0.5 * depth * free + 0.1 * depth * across(free, random));
    rig.tick(hip);
    rt::FixtureForces::Output output;
    for (int settle = 0; settle < 20; ++settle) output = rig.tick(hip);
    const double expected_n = kStiffness * depth;
    ASSERT_NEAR(norm(output.force_n), expected_n, 1e-3 * expected_n) << kind.name << " " << i;
    const double cosine = std::min(1.0, dot(output.force_n, free) / norm(output.force_n));
    ASSERT_LT(std::acos(cosine), 0.1 * std::numbers::pi / 180) << kind.name << " " << i;
    ASSERT_NEAR(output.distance_m, -depth, 1e-3 * depth) << kind.name << " " << i;
    ASSERT_NEAR(output.stored_j, 0.5 * kStiffness * depth * depth, 3e-3 * output.stored_j);
  }
}

TEST_P(EachShape, KeepsOutWithTheForceOfTheClosedForm) {
  expectClosedForm(GetParam(), FixtureSide::out, 1);
}
TEST_P(EachShape, KeepsInWithTheForceOfTheClosedForm) {
  expectClosedForm(GetParam(), FixtureSide::in, 2);
}
TEST_P(EachShape, BothSidesHoldTheHipWhereItBegan) {
  RandomShapes random(3);
  for (const bool inside : {false, true}) {
    for (int i = 0; i < 200; ++i) {
      FixtureRig rig;
      Shape shape;
      const BoundaryPoint point = GetParam().make(shape, random);
      const Vec3 free = inside ? -point.outward : point.outward;
      rig[rig.add(GetParam().kind, shape)].side = FixtureSide::both;
      rig.jumpTo(point.place + 0.5 * point.most_depth_m * free);
      const auto output = rig.moveTo(point.place - 0.2 * point.most_depth_m * free);
      ASSERT_GT(dot(output.force_n, free), 0);
      ASSERT_GE(dot(output.proxy_m_in_world - point.place, free), -1e-4 - 0.1 * point.most_depth_m);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, EachShape,
                         testing::Values(KindOfShape{"plane", FixtureKind::plane, onPlane},
                                         KindOfShape{"sphere", FixtureKind::sphere, onSphere},
                                         KindOfShape{"box", FixtureKind::box, onBox},
                                         KindOfShape{"capsule", FixtureKind::capsule, onCapsule},
                                         KindOfShape{"cone", FixtureKind::cone, onCone}),
                         [](const auto& param) { return param.param.name; });

TEST(ForbiddenRegion, ClearanceEnlargesIt) {
  FixtureRig rig;
  Shape sphere{.kind = ShapeKind::sphere};
  sphere.radius_m = 0.05;
  rig[rig.add(FixtureKind::sphere, sphere)].clearance_m = 0.01;
  rig.jumpTo({0, 0, 0.1});
  EXPECT_EQ(rig.moveTo({0, 0, 0.0601}).force_n, Vec3{});
  EXPECT_NEAR(rig.moveTo({0, 0, 0.055}).force_n.z, 300 * 0.005, 1e-6);
}

TEST(ForbiddenRegion, ItsLargestForceLimitsTheForceAndNeverTheProxy) {
  FixtureRig rig;
  Shape box{.kind = ShapeKind::box};
  box.half_size_m = {0.1, 0.1, 0.0005};
  rig[rig.add(FixtureKind::box, box)].max_force_n = 2;
  rig.jumpTo({0, 0, 0.01});
  for (double z = 0.01; z > -0.5; z -= 0.001) {
    const auto output = rig.tick({0, 0, z});
    ASSERT_LE(norm(output.force_n), 2 + 1e-12);
    if (z < 0) {
      ASSERT_NEAR(output.proxy_m_in_world.z, 0.0005, 1e-9) << z;
    }
  }
}

TEST(ForbiddenRegion, DampingActsOnlyWhileApproachingAndNeverPulls) {
  FixtureRig rig;
  Shape plane{.kind = ShapeKind::plane};
  rig[rig.add(FixtureKind::plane, plane)].damping_n_s_per_m = 5;
  rig.jumpTo({0, 0, 0.01});
  rig.moveTo({0, 0, -0.004}, 0.0002);
  const double approaching = rig.tick({0, 0, -0.0042}).force_n.z;
  EXPECT_NEAR(approaching, 300 * 0.0042 + 5 * 0.2, 1e-9);
  const double leaving = rig.tick({0, 0, -0.0040}).force_n.z;
  EXPECT_NEAR(leaving, 300 * 0.0040, 1e-9);
}

/// A hand that pushes along `push` with random lateral motion of up to 1 m/s, without regard to any force.
struct Push {
  Vec3 from;
  Vec3 push;
  double depth_m;
};

/// Pushes and asserts that the proxy stays where `allowed` is true.
void expectHeld(FixtureRig& rig, const Push& push, RandomShapes& random, const auto& allowed) {
  rig.jumpTo(push.from);
  Vec3 drift;
  constexpr int kTicks = 120;
  for (int i = 0; i < kTicks; ++i) {
    drift = 0.98 * drift + random.between(0, 1) * 0.001 * across(push.push, random);
    const Vec3 hip = push.from + (push.depth_m * (i + 1) / kTicks) * push.push + drift;
    const auto output = rig.tick(hip);
    if (!output.holds) continue;
    ASSERT_TRUE(allowed(output.proxy_m_in_world)) << "tick " << i;
  }
  const auto last = rig.tick(push.from + push.depth_m * push.push + drift);
  ASSERT_TRUE(last.holds) << "the HIP went through";
  ASSERT_LT(dot(last.force_n, push.push), 0);
}

constexpr int kPushes = 400;
constexpr double kOnBoundary_m = 1e-6;

TEST(ForbiddenRegion, NoPushGetsThroughAPlateOfOneMillimetre) {
  RandomShapes random(4);
  for (int i = 0; i < kPushes; ++i) {
    FixtureRig rig;
    Shape plate{.kind = ShapeKind::box, .position_m_in_world = random.place(0.1)};
    plate.rotation = random.rotation();
    plate.half_size_m = {0.3, 0.3, 0.0005};
    rig.add(FixtureKind::box, plate);
    const Vec3 up = times(plate.rotation, {0, 0, 1});
    const double obliquity = random.between(0, 0.7);
    const Vec3 push = -std::cos(obliquity) * up + std::sin(obliquity) * across(up, random);
    expectHeld(
        rig, {plate.position_m_in_world + 0.005 * up, push, random.between(0.02, 0.2)}, random,
        [&](const Vec3& p) { return dot(p - plate.position_m_in_world, up) > 0.0005 - kOnBoundary_m; });
    if (HasFatalFailure()) return;
  }
}

TEST(ForbiddenRegion, TwoThatMeetAtThirtyDegreesHoldInTheirCorner) {
  RandomShapes random(5);
  constexpr double kHalfOpening_rad = 15 * std::numbers::pi / 180;
  for (int i = 0; i < kPushes; ++i) {
    FixtureRig rig;
    const std::array<double, 9> r = random.rotation();
    const Vec3 corner = random.place(0.1);
    const Vec3 out = times(r, {0, 0, 1});
    const Vec3 side = times(r, {1, 0, 0});
    // the allowed wedge opens along `out`; plates of one millimetre bound it
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 along = std::cos(kHalfOpening_rad) * out + sign * std::sin(kHalfOpening_rad) * side;
      const Vec3 normal = std::sin(kHalfOpening_rad) * out - sign * std::cos(kHalfOpening_rad) * side;
      const Vec3 third = cross(normal, along);
      Shape plate{.kind = ShapeKind::box, .position_m_in_world = corner + 0.2 * along - 0.0005 * normal};
      plate.rotation = {along.x, third.x, normal.x, along.y, third.y, normal.y, along.z, third.z, normal.z};
      plate.half_size_m = {0.25, 0.3, 0.0005};
      rig.add(FixtureKind::box, plate, sign < 0 ? 300 : random.between(100, 1000));
    }
    const Vec3 from = corner + 0.04 * out;
    rig.jumpTo(from);
    Vec3 drift;
    for (int tick = 0; tick < 120; ++tick) {
      drift = 0.98 * drift + random.between(0, 1) * 0.001 * across(out, random);
      const Vec3 hip = from - (0.08 * (tick + 1) / 120) * out + drift;
      const auto output = rig.tick(hip);
      if (!output.holds) continue;
      for (std::size_t plate = 0; plate < 2; ++plate) {
        const rt::RegionMemory& region = rig.forces.memory().fixtures[plate].region;
        if (!region.held) continue;
        const Shape& shape = rig[plate].shape;
        const Vec3 normal = times(shape.rotation, {0, 0, 1});
        ASSERT_GT(dot(region.proxy_m_in_world - shape.position_m_in_world, normal), 0.0005 - kOnBoundary_m)
            << "push " << i << " tick " << tick;
      }
    }
    const auto last = rig.tick(corner - 0.013 * out);
    ASSERT_EQ(last.in_contact, 3U);
    Vec3 expected_n;
    for (std::size_t plate = 0; plate < 2; ++plate) {
      const Vec3 normal = times(rig[plate].shape.rotation, {0, 0, 1});
      expected_n += (rig[plate].stiffness_n_per_m * 0.013 * std::sin(kHalfOpening_rad)) * normal;
    }
    ASSERT_NEAR(norm(last.force_n - expected_n), 0, 1e-9) << "each pushes as it does alone";
  }
}

TEST(ForbiddenRegion, APlateThatMovesTowardsTheHandCarriesItsSideAlong) {
  RandomShapes random(6);
  for (int i = 0; i < kPushes; ++i) {
    FixtureRig rig;
    Shape plate{.kind = ShapeKind::box};
    plate.half_size_m = {0.3, 0.3, 0.0005};
    const std::size_t index = rig.add(FixtureKind::box, plate);
    const double speed = random.between(0.02, 0.5);
    const double spin = random.between(-1, 1);
    rig.jumpTo({0, 0, random.between(0.001, 0.02)});
    double time_s = 0;
    for (int tick = 0; tick < 400; ++tick) {
      time_s += FixtureRig::kTick_s;
      if (tick % 33 == 0) {  // as a tracker of 30 Hz moves it
        Shape& shape = rig[index].shape;
        shape.position_m_in_world.z = speed * time_s;
        const double angle = 0.3 * spin * time_s;
        shape.rotation = {std::cos(angle), 0, std::sin(angle), 0, 1, 0, -std::sin(angle), 0, std::cos(angle)};
        rig.redefine(index);
      }
      const auto output = rig.tick({0.02 * std::sin(0.01 * tick), 0, 0.005});
      const Shape& shape = rig[index].shape;
      const Vec3 up = times(shape.rotation, {0, 0, 1});
      const double hip_above =
          dot(Vec3{0.02 * std::sin(0.01 * tick), 0, 0.005} - shape.position_m_in_world, up);
      if (hip_above < 0.0005) {
        ASSERT_TRUE(output.holds) << i << " " << tick;
        ASSERT_GT(dot(output.force_n, up), 0) << i << " " << tick;
      }
    }
  }
}

TEST(ForbiddenRegion, OneThatAppearsAroundTheHandGrowsSlowly) {
  FixtureRig rig;
  Shape box{.kind = ShapeKind::box};
  box.half_size_m = {0.1, 0.1, 0.1};
  rig.jumpTo({0.03, 0.02, 0.09});
  rig[rig.add(FixtureKind::box, box)].max_force_n = 2;
  double before = 0;
  for (int tick = 0; tick < 3000; ++tick) {
    const double force_n = norm(rig.tick({0.03, 0.02, 0.09}).force_n);
    // 300 N/m at 5 mm/s
    ASSERT_LE(force_n, before + 300 * 0.005 * FixtureRig::kTick_s + 1e-9) << tick;
    before = force_n;
  }
  EXPECT_NEAR(before, 2, 1e-6);
}

TEST(ForbiddenRegion, LeavingOneThatGrowsLetsItGrowAtOnce) {
  FixtureRig rig;
  Shape plane{.kind = ShapeKind::plane};
  rig.jumpTo({0, 0, -0.02});
  rig.add(FixtureKind::plane, plane);
  rig.tick({0, 0, -0.02});
  rig.moveTo({0, 0, -0.005});
  EXPECT_GE(norm(rig.moveTo({0, 0, -0.01}).force_n), 300 * 0.005 - 1e-9) << "it does not go back";
}

TEST(ForbiddenRegion, WithoutAnAllowedPlaceEachPushesBack) {
  FixtureRig rig;
  Shape up{.kind = ShapeKind::plane, .position_m_in_world = {0, 0, 0.01}};
  Shape down{.kind = ShapeKind::plane, .position_m_in_world = {0, 0, -0.01}, .axis_in_world = {0, 0, -1}};
  rig.jumpTo({0, 0, 0.05});
  rig.add(FixtureKind::plane, up);
  rig.tick({0, 0, 0.05});
  rig.add(FixtureKind::plane, down);
  for (int tick = 0; tick < 20000; ++tick) {
    const auto output = rig.tick({0, 0, 0.05 * std::cos(0.01 * tick)});
    ASSERT_TRUE(isFinite(output.force_n));
    ASSERT_LT(norm(output.force_n), 300 * 0.2);
  }
}

}  // namespace
}  // namespace hapticd::test
