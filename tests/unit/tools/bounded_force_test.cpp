// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/bounded_force.h"

#include <gtest/gtest.h>

#include <limits>

#include "tools/haptic-bridge/damped_force.h"

namespace hapticd::tools {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(BoundedForce, KeepsTheDirectionAndCutsTheLength) {
  EXPECT_EQ(boundedForce({3, 0, 4}, 10), (rt::Vec3{3, 0, 4}));
  EXPECT_EQ(boundedForce({3, 0, 4}, 5), (rt::Vec3{3, 0, 4}));
  const rt::Vec3 cut = boundedForce({30, 0, -40}, 5);
  EXPECT_DOUBLE_EQ(cut.x, 3);
  EXPECT_EQ(cut.y, 0);
  EXPECT_DOUBLE_EQ(cut.z, -4);
}

TEST(BoundedForce, IsNoneWhereTheForceOrTheLimitIsNoFiniteNumber) {
  for (const double bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(boundedForce({3, 0, 4}, bad), rt::Vec3{}) << "limit " << bad;
    EXPECT_EQ(boundedForce({bad, 0, 0}, 5), rt::Vec3{}) << "x " << bad;
    EXPECT_EQ(boundedForce({0, bad, 0}, 5), rt::Vec3{}) << "y " << bad;
    EXPECT_EQ(boundedForce({1, 1, bad}, 5), rt::Vec3{}) << "z " << bad;
  }
  EXPECT_EQ(boundedForce({1e300, 1e300, 0}, 5), rt::Vec3{}) << "its length is beyond all numbers";
  EXPECT_EQ(boundedForce({1, 0, 0}, 0), rt::Vec3{});
  EXPECT_EQ(boundedForce({1, 0, 0}, -1), rt::Vec3{});
}

TEST(DampedForce, IsLessOnTheWayOutMoreOnTheWayInAndNeverPulls) {
  const rt::Vec3 force{0, 0, 4};
  EXPECT_EQ(dampedForce(force, {0, 0, 0.1}, 5), (rt::Vec3{0, 0, 3.5}));
  EXPECT_EQ(dampedForce(force, {0, 0, -0.1}, 5), (rt::Vec3{0, 0, 4.5}));
  EXPECT_EQ(dampedForce(force, {3, -2, 0}, 5), force) << "nothing along the surface";
  EXPECT_EQ(dampedForce(force, {0, 0, 1}, 5), rt::Vec3{});
  EXPECT_EQ(dampedForce({}, {0, 0, 1}, 5), rt::Vec3{}) << "no contact, no damping";
  EXPECT_EQ(boundedForce(dampedForce(force, {0, 0, kNan}, 5), 10), rt::Vec3{});
}

}  // namespace
}  // namespace hapticd::tools
