// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/box_commands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace hapticd::tools::ros {
namespace {

using rt::Vec3;

std::array<double, 3> parts(const Vec3& v) {
  return {v.x, v.y, v.z};
}
Vec3 vectorFrom(const Json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

/// The force that CRTK defines: along each axis of the springs, beyond the deadband of the side.
Vec3 definedForce(const Impedance& impedance, const Vec3& position_m) {
  const auto displacement =
      parts(rotated(inverse(impedance.force_orientation), position_m - impedance.force_position_m));
  std::array<double, 3> force{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool positive = displacement[axis] > 0;
    const ImpedanceSide& side = positive ? impedance.position_positive : impedance.position_negative;
    const double beyond = std::max(0.0, std::abs(displacement[axis]) - std::abs(parts(side.deadband)[axis]));
    force[axis] = parts(side.p)[axis] * (positive ? beyond : -beyond);
  }
  return rotated(impedance.force_orientation, {force[0], force[1], force[2]});
}

/// The force of planes, each of which keeps what is behind it off with a spring along its normal.
Vec3 forceOf(const Json& planes, const Vec3& position_m) {
  Vec3 force;
  for (const Json& plane : planes) {
    EXPECT_EQ(plane["kind"], "plane");
    const Vec3 normal = vectorFrom(plane["normal"]);
    EXPECT_NEAR(norm(normal), 1, 1e-12);
    const double depth = -dot(position_m - vectorFrom(plane["position_m"]), normal);
    if (depth > 0) force += plane["stiffness_n_per_m"].get<double>() * depth * normal;
  }
  return force;
}

class RandomImpedance {
 public:
  Impedance next() {
    Impedance impedance;
    impedance.force_orientation = rt::quaternionOf(vector(-3, 3));
    impedance.force_position_m = vector(-0.2, 0.2);
    for (ImpedanceSide* side : {&impedance.position_positive, &impedance.position_negative}) {
      side->p = {stiffness(), stiffness(), stiffness()};
      side->deadband = vector(-0.01, 0.01);
    }
    return impedance;
  }
  Vec3 vector(double from, double to) {
    std::uniform_real_distribution<double> any(from, to);
    const double x = any(random_);
    const double y = any(random_);
    return {x, y, any(random_)};
  }

 private:
  /// None on every third side.
  double stiffness() {
    return random_() % 3 == 0 ? 0 : std::uniform_real_distribution<double>(-2000, -10)(random_);
  }
  std::mt19937 random_{11};
};

TEST(ImpedanceFixtures, ExertTheForceThatCrtkDefines) {
  RandomImpedance random;
  for (int run = 0; run < 500; ++run) {
    const Impedance impedance = random.next();
    const auto planes = fixturesOf(impedance);
    ASSERT_TRUE(planes) << planes.error();
    for (int place = 0; place < 20; ++place) {
      const Vec3 position_m = impedance.force_position_m + random.vector(-0.05, 0.05);
      // roundings of forces of up to 100 N
      ASSERT_LT(norm(forceOf(*planes, position_m) - definedForce(impedance, position_m)), 1e-10);
    }
  }
}

TEST(ImpedanceFixtures, AreNoneWithoutASpring) {
  const auto none = fixturesOf({});
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
}

TEST(ImpedanceFixtures, HaveOnlyNamesThatAreRemovedAgain) {
  Impedance impedance;
  for (ImpedanceSide* side : {&impedance.position_positive, &impedance.position_negative})
    side->p = {-1, -1, -1};
  const auto planes = fixturesOf(impedance);
  ASSERT_TRUE(planes);
  std::vector<std::string> names;
  for (const Json& plane : *planes) names.push_back(plane["name"]);
  std::ranges::sort(names);
  std::vector<std::string> all = impedanceFixtureNames();
  std::ranges::sort(all);
  EXPECT_EQ(names, all);
}

TEST(ImpedanceFixtures, RefuseInASentenceWhatIsNotPassiveOrNotThere) {
  const auto refused = [](auto change, const std::string& words) {
    Impedance impedance;
    impedance.position_positive.p = {-100, 0, 0};
    change(impedance);
    const auto fixtures = fixturesOf(impedance);
    ASSERT_FALSE(fixtures) << words;
    EXPECT_TRUE(fixtures.error().contains(words)) << fixtures.error();
  };
  refused([](Impedance& i) { i.position_positive.p.x = 100; }, "pushes away");
  refused([](Impedance& i) { i.position_negative.p.y = 1e-9; }, "pushes away");
  refused([](Impedance& i) { i.position_positive.d.x = 1; }, "motion grows");
  refused([](Impedance& i) { i.position_positive.d.y = -1; }, "effect: slow");
  refused([](Impedance& i) { i.position_negative.bias.z = -0.1; }, "bias");
  refused([](Impedance& i) { i.orientation_positive.p.x = -1; }, "torques");
  refused([](Impedance& i) { i.orientation_negative.d.z = -1; }, "torques");
  refused([](Impedance& i) { i.force_orientation = {0, 0, 0, 0}; }, "unit quaternion");
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  refused([](Impedance& i) { i.force_orientation.w = kNaN; }, "unit quaternion");
  refused([](Impedance& i) { i.force_position_m.x = kNaN; }, "finite");
  refused([](Impedance& i) { i.position_positive.p.x = -std::numeric_limits<double>::infinity(); }, "finite");
  refused([](Impedance& i) { i.position_negative.deadband.x = kNaN; }, "finite");
}

}  // namespace
}  // namespace hapticd::tools::ros
