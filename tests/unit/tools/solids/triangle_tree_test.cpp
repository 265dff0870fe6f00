// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/unit/tools/solids/made_up_solids.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;

Vec3 anywhere(std::mt19937_64& random, double reach_m) {
  std::uniform_real_distribution<double> place(-reach_m, reach_m);
  return {place(random), place(random), place(random)};
}

/// Sum over all triangles.
double exactWinding(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points_m[t[0]] - p, b = mesh.points_m[t[1]] - p, c = mesh.points_m[t[2]] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// By dense sampling of barycentric coordinates: an upper bound that is near.
double sampledDistance(const std::array<Vec3, 3>& c, const Vec3& p) {
  constexpr int kSteps = 60;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; i + j <= kSteps; ++j) {
      const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
      least = std::min(least, norm(p - ((1 - u - v) * c[0] + u * c[1] + v * c[2])));
    }
  return least;
}

TEST(TriangleTree, HasTheDistanceToATriangle) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    TriangleMesh mesh{{anywhere(random, 1), anywhere(random, 1), anywhere(random, 1)}, {{0, 1, 2}}};
    if (trial % 10 == 0)
      mesh.points_m[2] = mesh.points_m[0] + 0.3 * (mesh.points_m[1] - mesh.points_m[0]);  // flat
    const TriangleTree tree(mesh);
    const Vec3 p = anywhere(random, 1.5);
    const double found = std::sqrt(tree.nearest(p).squared_m2),
                 sampled = sampledDistance(tree.corners_m(0), p);
    EXPECT_LE(found, sampled + 1e-12);
    // the nearest sample is at most a step of the longest edge (below 3.5) away from the nearest place
    EXPECT_GE(found, sampled - 3.5 / 60);
  }
}

TEST(TriangleTree, FindsTheNearestOfAllTriangles) {
  std::mt19937_64 random(2);
  const TriangleMesh mesh = test::torusBody({}, 0.04, 0.015, 20).mesh;
  const TriangleTree tree(mesh);
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3 p = anywhere(random, 0.08);
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
      least = std::min(least, tree.squaredDistance(p, i));
    EXPECT_EQ(tree.nearest(p).squared_m2, least);
  }
}

TEST(TriangleTree, WindsOnceAboutTheInsideOfABox) {
  const TriangleTree tree(test::boxBody({}, {0.020, 0.030, 0.040}).mesh);
  EXPECT_NEAR(tree.winding({0, 0, 0}), 1, 1e-12);
  EXPECT_NEAR(tree.winding({0.012, 0, 0}), 0, 1e-12);
}

/// Distance and direction of a box of 20 x 30 x 40 mm, worked out by hand.
TEST(TriangleTree, HasTheSignedDistanceOfABox) {
  const TriangleTree tree(test::boxBody({}, {0.020, 0.030, 0.040}).mesh);
  const auto signedDistance_mm = [&](const Vec3& p_mm) {
    const double distance_mm = 1e3 * std::sqrt(tree.nearest(1e-3 * p_mm).squared_m2);
    return tree.winding(1e-3 * p_mm) > 0.5 ? -distance_mm : distance_mm;
  };
  struct Golden {
    Vec3 place_mm;
    double distance_mm;
    Vec3 gradient;  ///< zero: there is none
  };
  for (const Golden& golden :
       {Golden{{12, 0, 0}, 2, {1, 0, 0}}, Golden{{13, 19, 0}, 5, {0.6, 0.8, 0}},
        Golden{{13, 19, 32}, 13, {3.0 / 13, 4.0 / 13, 12.0 / 13}}, Golden{{4, 0, -25}, 5, {0, 0, -1}},
        Golden{{9, 0, 0}, -1, {1, 0, 0}}, Golden{{0, 14, 0}, -1, {0, 1, 0}}, Golden{{8, 13, 0}, -2, {}},
        Golden{{0, 0, 0}, -10, {}}, Golden{{-10, 0, 0}, 0, {-1, 0, 0}}}) {
    EXPECT_NEAR(signedDistance_mm(golden.place_mm), golden.distance_mm, 1e-12);
    if (norm(golden.gradient) == 0) continue;
    constexpr double kStep_mm = 1e-4;  // its square, over the distance of 5 mm, is the error
    const auto slope = [&](const Vec3& d) {
      return (signedDistance_mm(golden.place_mm + kStep_mm * d) -
              signedDistance_mm(golden.place_mm - kStep_mm * d)) /
             (2 * kStep_mm);
    };
    EXPECT_LT(norm(Vec3{slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1})} - golden.gradient), 1e-8);
  }
}

TEST(TriangleTree, WindsNearlyAsTheSumOverAllTriangles) {
  std::mt19937_64 random(3);
  TriangleMesh mesh = test::torusBody({}, 0.04, 0.015, 40).mesh;
  std::erase_if(mesh.triangles, [&](const Triangle&) { return random() % 10 == 0; });
  const TriangleTree tree(mesh);
  for (int trial = 0; trial < 500; ++trial) {
    const Vec3 p = anywhere(random, 0.08);
    EXPECT_NEAR(tree.winding(p), exactWinding(mesh, p), 0.07);  // as the function's comment says
  }
}

TEST(TriangleTree, MeetsTheFirstTriangleAlongARay) {
  std::mt19937_64 random(4);
  const TriangleMesh mesh = test::sphereBody({}, 0.03, 24).mesh;
  const TriangleTree tree(mesh);
  const double sagitta_m = test::sphereBody({}, 0.03, 24).sagitta_m;
  for (int trial = 0; trial < 200; ++trial) {
    Vec3 direction = anywhere(random, 1);
    direction = (1 / norm(direction)) * direction;
    const auto from_centre = tree.firstHit({}, direction, TriangleTree::kNone);
    ASSERT_TRUE(from_centre);
    EXPECT_NEAR(from_centre->distance_m, 0.03 - sagitta_m / 2, sagitta_m / 2);
    EXPECT_FALSE(tree.firstHit(0.05 * direction, direction, TriangleTree::kNone));
  }
}

}  // namespace
}  // namespace hapticd::solids
