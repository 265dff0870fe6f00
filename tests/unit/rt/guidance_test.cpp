// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/rt/fixture_rig.h"

// Guidance along paths and to points.
namespace hapticd::test {
namespace {

using rt::FixtureKind;
using rt::PathElement;
using rt::Vec3;
using Points = std::vector<Vec3>;

constexpr double kTick_s = FixtureRig::kTick_s;
constexpr double kStiffness = 300;
constexpr double kBend_m = 0.002;

Points zigzag() {
  Points points;
  for (int i = 0; i < 12; ++i) points.push_back({0.02 * i, i % 2 == 0 ? 0 : 0.015, 0});
  return points;
}
Points hairpin() {
  return {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.004, 0}, {0, 0.004, 0}};
}
Points crossing() {
  return {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.05, 0}, {0.05, 0.05, 0}, {0.05, -0.05, 0}};
}
Points helix() {
  Points points;
  for (int i = 0; i < 256; ++i) {
    const double angle = 0.15 * i;
    points.push_back({0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.0005 * i});
  }
  return points;
}

std::vector<PathElement> smoothed(const Points& points, double bend_m = kBend_m) {
  std::vector<PathElement> elements(2 * points.size());
  elements.resize(rt::smoothPath(points, bend_m, elements));
  return elements;
}
double lengthOf(const std::vector<PathElement>& path) {
  return path.back().from_m + path.back().length_m;
}
rt::PlaceOnPath placeAt(const std::vector<PathElement>& path, double along_m) {
  const auto behind = std::ranges::find_if(
      path, [along_m](const PathElement& element) { return element.from_m + element.length_m >= along_m; });
  const PathElement& element = behind == path.end() ? path.back() : *behind;
  return rt::placeOn(element, std::min(along_m - element.from_m, element.length_m));
}

struct NamedPath {
  const char* name;
  Points (*points)();
};
class EachPath : public testing::TestWithParam<NamedPath> {};

TEST_P(EachPath, HasNoCornersAndPassesNearItsPoints) {
  const Points points = GetParam().points();
  const auto path = smoothed(points);
  EXPECT_LE(path.size(), 2 * points.size());
  for (std::size_t i = 1; i < path.size(); ++i) {
    const rt::PlaceOnPath end = rt::placeOn(path[i - 1], path[i - 1].length_m);
    ASSERT_LT(norm(end.place_m_in_world - path[i].start_m_in_world), 1e-9) << i;
    ASSERT_LT(norm(end.tangent_in_world - path[i].tangent_in_world), 1e-6) << i;
    ASSERT_NEAR(path[i].from_m, path[i - 1].from_m + path[i - 1].length_m, 1e-12);
    ASSERT_LE(path[i].curvature_per_m, 2 / kBend_m + 1e-6)
        << "half the radius where a hairpin leaves no room";
  }
  EXPECT_LT(norm(path.front().start_m_in_world - points.front()), 1e-12);
  EXPECT_LT(norm(placeAt(path, lengthOf(path)).place_m_in_world - points.back()), 1e-9);
}

/// Moves the HIP beside the path at 1 m/s and asserts the bound of the force's steps. Returns the largest
/// distance of the guided place from the one beside the HIP.
void expectSmoothForce(const NamedPath& named, double beside_m) {
  FixtureRig rig;
  rig.addPath(named.points(), kBend_m, kStiffness);
  const auto path = smoothed(named.points());
  const auto hipAt = [&](double along_m) {
    const auto [place, tangent] = placeAt(path, along_m);
    const Vec3 up = std::abs(tangent.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    const Vec3 aside = cross(up, tangent);
    return place + (beside_m / norm(aside)) * aside + Vec3{0, 0, 0.001};
  };
  for (int i = 0; i < 200; ++i) rig.tick(hipAt(0));
  Vec3 hip = hipAt(0);
  Vec3 before = rig.tick(hip).guidance_force_n;
  double along = 0;
  while (along < lengthOf(path)) {
    // in curves the HIP moves faster or slower than its place on the path: 1 m/s of the HIP itself
    double step = 0.001;
    while (norm(hipAt(along + step) - hip) > 0.001 && step > 1e-6) step *= 0.7;
    along += step;
    const Vec3 next = hipAt(along);
    const double moved = norm(next - hip);
    hip = next;
    const Vec3 force = rig.tick(hip).guidance_force_n;
    ASSERT_LE(norm(force - before), kStiffness * moved + 0.05) << named.name << " at " << along;
    before = force;
  }
}

TEST_P(EachPath, TheForceDoesNotStepAtOneMetrePerSecond) {
  for (const double beside_m : {0.0, 0.001, -0.001, 0.003, -0.003, 0.006, -0.006})
    expectSmoothForce(GetParam(), beside_m);
}

/// A hand that pulls the device along a path and aside with a constant force.
TEST_P(EachPath, TheHandStaysOnThePathWithinItsOwnForce) {
  constexpr double kMass_kg = 0.15;
  constexpr double kAside_n = 0.3;
  constexpr double kSpeed = 0.02;
  FixtureRig rig;
  const std::size_t index = rig.addPath(GetParam().points(), kBend_m, 1000);
  rig[index].damping_n_s_per_m = 5;
  const auto path = smoothed(GetParam().points());
  Vec3 place = placeAt(path, 0).place_m_in_world;
  Vec3 velocity;
  double along = 0;
  double worst_m = 0;
  for (int tick = 0; along < lengthOf(path) - 0.003; ++tick) {
    ASSERT_LT(tick, 100'000) << "the hand got stuck at " << along;
    const Vec3 force = rig.tick(place).guidance_force_n;
    // the hand knows the path's direction where it is, and steers along it with damping
    double best = 1;
    for (double at = std::max(0.0, along - 0.001); at < along + 0.002; at += 5e-5) {
      const double distance = norm(placeAt(path, at).place_m_in_world - place);
      if (distance >= best) continue;
      best = distance;
      along = at;
    }
    const Vec3 tangent = placeAt(path, along).tangent_in_world;
    const Vec3 hand = 8.0 * (kSpeed * tangent - dot(velocity, tangent) * tangent) + Vec3{0, 0, kAside_n};
    const Vec3 aside = hand - dot(hand, tangent) * tangent;
    velocity += (kTick_s / kMass_kg) * (force + hand);
    place += kTick_s * velocity;
    if (tick > 1500) {
      worst_m = std::max(worst_m, best - norm(aside) / 1000);
    }
  }
  EXPECT_LT(worst_m, 0.0002) << GetParam().name;
}

INSTANTIATE_TEST_SUITE_P(Paths, EachPath,
                         testing::Values(NamedPath{"zigzag", zigzag}, NamedPath{"hairpin", hairpin},
                                         NamedPath{"crossing", crossing}, NamedPath{"helix", helix}),
                         [](const auto& param) { return param.param.name; });

TEST(Guidance, GoesStraightOnAtACrossing) {
  FixtureRig rig;
  rig.addPath(crossing(), kBend_m, kStiffness);
  for (int i = 0; i < 100; ++i) rig.tick({0.02, 0, 0});
  // along the first line over the crossing at x = 0.05: the last line would pull to x = 0.05
  for (double x = 0.02; x < 0.08; x += 0.0005) {
    const auto output = rig.tick({x, 0.001, 0});
    if (x < 0.021) continue;
    ASSERT_NEAR(output.guidance_force_n.x, 0, 0.01) << x;
    ASSERT_NEAR(output.guidance_force_n.y, -kStiffness * 0.001, 0.06) << x;
  }
}

// Closed curves. Where the first and the last point meet is a place like any other.

Points square() {
  return {{0, 0, 0}, {0.06, 0, 0}, {0.06, 0.06, 0}, {0, 0.06, 0}, {0, 0, 0}};
}
Points ring(int points, double gap_m = 0) {
  Points ring;
  for (int i = 0; i <= points; ++i) {
    const double angle = 2 * std::numbers::pi * i / points;
    ring.push_back({0.04 * std::cos(angle), 0.04 * std::sin(angle), 0.005 * std::sin(2 * angle)});
  }
  ring.back().z += gap_m;
  return ring;
}

TEST(ClosedPath, EndsWhereItBeginsAndInTheSameDirection) {
  for (const Points& points : {square(), ring(3), ring(60), ring(255), ring(60, 0.0004)}) {
    const auto path = smoothed(points);
    EXPECT_LE(path.size(), 2 * points.size());
    const rt::PlaceOnPath end = rt::placeOn(path.back(), path.back().length_m);
    EXPECT_LT(norm(end.place_m_in_world - path.front().start_m_in_world), 1e-9);
    EXPECT_LT(norm(end.tangent_in_world - path.front().tangent_in_world), 1e-6);
  }
  const auto open = smoothed(ring(60, 0.0006));
  EXPECT_EQ(open.front().start_m_in_world, ring(60).front());
}

// The HIP is led round and round, beside the path by what varies over a round but is the same in each. The
// force is that of the spring to the nearest place everywhere, and a round takes no energy out of the path.
TEST(ClosedPath, TheHandIsLedRoundAndRound) {
  for (const Points& points : {square(), ring(60), ring(60, 0.0004)}) {
    FixtureRig rig;
    rig.addPath(points, kBend_m, kStiffness);
    const auto path = smoothed(points);
    const double length = lengthOf(path);
    constexpr int kTicksPerRound = 4000;
    const auto offsetAt = [&](int tick) {
      const double turn = 2 * std::numbers::pi * tick / kTicksPerRound;
      return (0.0005 + 0.0003 * std::sin(3 * turn)) * Vec3{0, 0, 1};
    };
    const auto hipAt = [&](int tick) {
      const double along_m = length * (tick % kTicksPerRound) / kTicksPerRound;
      return placeAt(path, along_m).place_m_in_world + offsetAt(tick);
    };
    rig.jumpTo(hipAt(0));
    for (int i = 0; i < 200; ++i) rig.tick(hipAt(0));
    Vec3 hip = hipAt(0);
    Vec3 force = rig.tick(hip).guidance_force_n;
    for (const int direction : {1, -1}) {
      for (int round = 0; round < 3; ++round) {
        double work_j = 0;
        for (int i = 1; i <= kTicksPerRound; ++i) {
          const int tick = direction > 0 ? i : kTicksPerRound - i;
          const Vec3 next = hipAt(tick);
          const Vec3 now = rig.tick(next).guidance_force_n;
          work_j += 0.5 * dot(force + now, next - hip);
          // the path rises and falls by at most 0.25 m per metre, so the nearest place is not straight below
          ASSERT_NEAR(norm(now), kStiffness * norm(offsetAt(tick)), 0.02) << tick;
          ASSERT_LE(norm(now - force), kStiffness * norm(next - hip) + 0.02) << tick;
          force = now;
          hip = next;
        }
        // rounding, and the error of the trapezoidal rule: second order in steps of 0.06 mm
        ASSERT_LT(work_j, 1e-6);
      }
    }
  }
}

TEST(Guidance, IsWeakerThanContact) {
  FixtureRig rig;
  rig.parameters.springs.stiffness_n_per_m = 600;
  rig.add(FixtureKind::point, {}, 500);
  rig.jumpTo({0.001, 0, 0});
  rt::FixtureForces::Output output;
  for (int i = 0; i < 1000; ++i) output = rig.tick({0.001, 0, 0});
  EXPECT_NEAR(norm(output.guidance_force_n), 200 * 0.001, 1e-9) << "a third of k_s";
  for (int i = 0; i < 1000; ++i) output = rig.tick({0.1, 0, 0});
  EXPECT_NEAR(norm(output.guidance_force_n), rig.parameters.safety.max_force_n / 3, 1e-9);
}

TEST(Guidance, ThereIsNoForceWithinTheDeadband) {
  FixtureRig rig;
  rig[rig.add(FixtureKind::point, {})].deadband_m = 0.005;
  rig.jumpTo({0.0049, 0, 0});
  for (int i = 0; i < 100; ++i) ASSERT_EQ(rig.tick({0.0049, 0, 0}).guidance_force_n, Vec3{});
  rt::FixtureForces::Output output;
  for (int i = 0; i < 200; ++i) output = rig.tick({0.006, 0, 0});
  EXPECT_NEAR(output.guidance_force_n.x, -kStiffness * 0.001, 1e-9);
}

TEST(Guidance, FadesIn) {
  FixtureRig rig;
  rig[rig.add(FixtureKind::point, {})].fade_in_s = 0.5;
  rig.jumpTo({0.003, 0, 0});
  for (int i = 1; i < 500; ++i) {
    const double force_n = norm(rig.tick({0.003, 0, 0}).guidance_force_n);
    ASSERT_NEAR(force_n, kStiffness * 0.003 * (i + 1) / 500, 1e-6) << i;
  }
}

TEST(Guidance, GivesWayToALargerForceAndComesBack) {
  FixtureRig rig;
  rig[rig.add(FixtureKind::point, {})].escape_force_n = 1;
  rig.jumpTo({0.003, 0, 0});
  rt::FixtureForces::Output output;
  for (int i = 0; i < 100; ++i) output = rig.tick({0.003, 0, 0});
  EXPECT_NEAR(norm(output.guidance_force_n), 0.9, 1e-6);
  for (int i = 0; i < 40; ++i) output = rig.tick({0.004, 0, 0});
  EXPECT_NEAR(norm(output.guidance_force_n), 1.2, 1e-6) << "not before 50 ms";
  for (int i = 0; i < 260; ++i) output = rig.tick({0.004, 0, 0});
  EXPECT_EQ(output.guidance_force_n, Vec3{});
  for (int i = 0; i < 300; ++i) output = rig.tick({0.002, 0, 0});
  EXPECT_EQ(output.guidance_force_n, Vec3{}) << "still beyond half of the distance";
  for (int i = 0; i < 300; ++i) output = rig.tick({0.001, 0, 0});
  EXPECT_NEAR(norm(output.guidance_force_n), 0.3, 1e-6);
}

TEST(Guidance, EndsWithoutAStepWhenItIsRemoved) {
  FixtureRig rig;
  const std::size_t index = rig.add(FixtureKind::point, {});
  rig.jumpTo({0.004, 0, 0});
  Vec3 before;
  for (int i = 0; i < 300; ++i) before = rig.tick({0.004, 0, 0}).guidance_force_n;
  ASSERT_GT(norm(before), 1);
  rig[index].enabled = false;
  ++rig.set->generation;
  for (int i = 0; i < 100; ++i) {
    const Vec3 force = rig.tick({0.004, 0, 0}).guidance_force_n;
    ASSERT_LE(norm(force - before), 0.05) << i;
    before = force;
  }
  EXPECT_EQ(before, Vec3{});
}

}  // namespace
}  // namespace hapticd::test
