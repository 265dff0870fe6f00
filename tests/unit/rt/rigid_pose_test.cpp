// SPDX-License-Identifier: Apache-2.0
#include "rt/base/rigid_pose.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "rt/base/pose.h"

namespace hapticd::rt {
namespace {

double lengthOf(const Quaternion& q) {
  return std::sqrt(dot(q, q));
}

TEST(ShortestRotation, TurnsAnyDirectionIntoAnyOther) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> number;
  const auto direction = [&] { return Vec3{number(random), number(random), number(random)}; };
  for (int i = 0; i < 300; ++i) {
    const Vec3 from = direction();
    Vec3 to = direction();
    if (i % 3 == 1) to = -2 * from;
    if (i % 3 == 2) to = -1 * from + 1e-9 * to;
    const Quaternion q = shortestRotation(from, to);
    const Vec3 difference = rotated(q, (1 / norm(from)) * from) - (1 / norm(to)) * to;
    EXPECT_LT(norm(difference), 1e-8) << i;
    EXPECT_NEAR(lengthOf(q), 1, 1e-12);
    EXPECT_LE(norm(rotationVectorOf(q)), M_PI + 1e-12);
  }
  for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const Quaternion none = shortestRotation(axis, 3 * axis);
    EXPECT_LT(norm(rotationVectorOf(none)), 1e-12);
    EXPECT_LT(norm(rotated(shortestRotation(axis, -1 * axis), axis) + axis), 1e-12);
  }
}

TEST(QuaternionOf, TurnsAsItsMatrix) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  for (int i = 0; i < 200; ++i) {
    const std::array<double, 9> r = rotationOf({{}, angle(random), angle(random), angle(random)});
    const Quaternion q = quaternionOf(r);
    EXPECT_NEAR(lengthOf(q), 1, 1e-12);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vec3 unit{axis == 0 ? 1.0 : 0, axis == 1 ? 1.0 : 0, axis == 2 ? 1.0 : 0};
      const Vec3 column{r[axis], r[3 + axis], r[6 + axis]};
      EXPECT_LT(norm(rotated(q, unit) - column), 1e-12) << i;
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
