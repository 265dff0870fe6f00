// SPDX-License-Identifier: Apache-2.0
// The oracles of the paper's equations, against its Table I and forces written out by hand.

#include "tools/lib/oracle/spring_oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "tests/support/recordings/made_up_scene.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Some roundings of numbers near 10.
constexpr double kRounding = 1e-13;

void expectNear(const Vec3& actual, const Vec3& expected, double tolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

TEST(ReferenceCamera, SeesEveryPixelWhereTableIPutsIt) {
  constexpr double fx = 594.214342, fy = 591.040537, cx = 339.307810, cy = 242.739138;
  constexpr double a = -0.003071102, b = 3.330949516;
  const std::vector<std::uint16_t> raw = test::sceneImage(0);  // with values too near, too far and behind
  const PointCloud cloud = ReferenceCamera().pointsOf(raw);
  std::size_t seen = 0;
  double largest_error_m = 0;
  for (std::uint32_t v = 0; v < 480; ++v) {
    for (std::uint32_t u = 0; u < 640; ++u) {
      const int d = raw[v * 640 + u];
      const double w = a * d + b;  // 1/Z
      if (d >= 2047 || w <= 0 || 1 / w < 0.4 || 1 / w > 4) continue;
      ASSERT_LT(seen, cloud.points_m.size());
      ASSERT_EQ(cloud.column[seen], u);
      ASSERT_EQ(cloud.row[seen], v);
      ASSERT_EQ(cloud.raw[seen], static_cast<std::uint32_t>(d));
      const Vec3 expected{(u - cx) / fx / w, -(v - cy) / fy / w, -1 / w};
      largest_error_m = std::max(largest_error_m, norm(cloud.points_m[seen] - expected));
      ++seen;
    }
  }
  EXPECT_EQ(cloud.points_m.size(), seen);
  EXPECT_GT(seen, 200'000U);
  // w is rounded to 2^-53 of b: 4e-16 per metre, times Z^2 of at most 16 m^2.
  EXPECT_LT(largest_error_m, 1e-14);
}

TEST(ReferenceCamera, KeepsToItsLimits) {
  const ReferenceCamera camera;
  EXPECT_FALSE(camera.accepts(270));   // 0.39967 m
  EXPECT_TRUE(camera.accepts(271));    // 0.40017 m
  EXPECT_TRUE(camera.accepts(1003));   // 3.9906 m
  EXPECT_FALSE(camera.accepts(1004));  // 4.0401 m
  EXPECT_FALSE(camera.accepts(2047));
}

TEST(ReferenceCamera, SeesTheDepthThatAnyCameraDelivers) {
  rt::DepthModelParameters camera;
  camera.width_px = 424;
  camera.height_px = 240;
  camera.fx_px = 200;
  camera.fy_px = 250;
  camera.cx_px = 211.5;
  camera.cy_px = 119.5;
  camera.law = rt::DepthLawKind::linear;
  camera.unit_m = 0.0005;
  camera.raw_no_measurement = 0;
  camera.raw_values = 65536;
  camera.near_m = 0.25;
  camera.far_m = 6;
  constexpr std::size_t kRowLength = 448;  // rows are padded to 64 pixels
  std::vector<std::uint16_t> raw(kRowLength * 240, 0);
  raw[3 * kRowLength + 11] = 2000;
  raw[3 * kRowLength + 430] = 2000;   // padding
  raw[200 * kRowLength + 423] = 500;  // at the near limit
  raw[200 * kRowLength + 422] = 499;  // nearer
  raw[201 * kRowLength] = 12000;      // at the far limit
  raw[201 * kRowLength + 1] = 12001;  // farther
  raw[202 * kRowLength + 1] = 65535;  // 32.8 m
  const PointCloud cloud = ReferenceCamera(camera).pointsOf(raw);
  ASSERT_EQ(cloud.points_m.size(), 3U);
  EXPECT_EQ(cloud.column, (std::vector<std::uint32_t>{11, 423, 0}));
  EXPECT_EQ(cloud.row, (std::vector<std::uint32_t>{3, 200, 201}));
  EXPECT_EQ(cloud.raw, (std::vector<std::uint32_t>{2000, 500, 12000}));
  expectNear(cloud.points_m[0], {-200.5 / 200, 116.5 / 250, -1}, kRounding);
  expectNear(cloud.points_m[1], {0.25 * 211.5 / 200, -0.25 * 80.5 / 250, -0.25}, kRounding);
  expectNear(cloud.points_m[2], {-6 * 211.5 / 200, -6 * 81.5 / 250, -6}, kRounding);
}

TEST(ReferenceCamera, RefusesWhatIsNoImageOfIt) {
  const std::vector<std::uint16_t> raw(std::size_t{640} * 480 + 1);
  const std::span<const std::uint16_t> all(raw);
  EXPECT_THROW(ReferenceCamera().pointsOf(all), std::invalid_argument);
  EXPECT_THROW(ReferenceCamera().pointsOf(all.first(std::size_t{639} * 480)), std::invalid_argument);
  EXPECT_NO_THROW(ReferenceCamera().pointsOf(all.first(std::size_t{640} * 480)));
}

// k_s = 500 N/m, D_thresh = 0.04 m: a point 0.01 m away pushes with 15 N, one 0.03 m away with 5 N.
constexpr rt::SpringParameters kTwoPoints{500, 0.04, 2, 2};

TEST(SpringOracle, IsTheMeanOfTheSpringsThatPushAwayFromThePoints) {
  const std::vector<Vec3> points{{0, 0, -1.01}, {0.03, 0, -1}, {0, 0.05, -1}};
  const SpringOracle oracle(points, {0, 0, -1}, kTwoPoints);
  EXPECT_EQ(oracle.pointsUsed(), 2U);
  expectNear(oracle.force_n(), {-2.5, 0, 7.5}, kRounding);
  EXPECT_EQ(oracle.rankMargin_m(), kInfinity);
  EXPECT_EQ(oracle.radiusMargin_m(), 0.04 - 0.03);
}

TEST(SpringOracle, HasNoForceBelowNMinPoints) {
  const std::vector<Vec3> points{{0, 0, -1.01}, {0.05, 0, -1}};
  const SpringOracle oracle(points, {0, 0, -1}, kTwoPoints);
  EXPECT_EQ(oracle.pointsUsed(), 0U);
  EXPECT_EQ(oracle.force_n(), Vec3{});
  EXPECT_EQ(oracle.error_n({0, 0, 2}), 2);
}

TEST(SpringOracle, TakesTheNearestPointsAndOfEquallyFarOnesTheFirst) {
  const std::vector<Vec3> points{{0.03, 0, -1}, {0, 0.03, -1}, {0, 0, -1.01}};
  const SpringOracle oracle(points, {0, 0, -1}, kTwoPoints);
  EXPECT_EQ(oracle.pointsUsed(), 2U);
  expectNear(oracle.force_n(), {-2.5, 0, 7.5}, kRounding);
  EXPECT_EQ(oracle.rankMargin_m(), 0);
}

TEST(SpringOracle, CountsAPointAtTheHipWithoutForce) {
  const std::vector<Vec3> points{{0, 0, -1}, {0, 0, -1.01}};
  const SpringOracle oracle(points, {0, 0, -1}, kTwoPoints);
  EXPECT_EQ(oracle.pointsUsed(), 2U);
  expectNear(oracle.force_n(), {0, 0, 7.5}, kRounding);
}

TEST(SpringOracle, CountsAPointAtTheRadiusAsWithinAndReportsTheMargins) {
  constexpr rt::SpringParameters kPowersOfTwo{512, 0.03125, 1, 1};  // exact in binary
  const std::vector<Vec3> points{{0, 0, -1.03125}};
  const SpringOracle at_radius(points, {0, 0, -1}, kPowersOfTwo);
  EXPECT_EQ(at_radius.pointsUsed(), 1U);
  EXPECT_EQ(at_radius.radiusMargin_m(), 0);
  const SpringOracle beyond(points, {0, 0, -1 + 0x1p-20}, kPowersOfTwo);
  EXPECT_EQ(beyond.pointsUsed(), 0U);
  EXPECT_EQ(beyond.radiusMargin_m(), 0x1p-20);
  const std::vector<Vec3> two{{0, 0, -1.0078125}, {0.015625, 0, -1}};
  EXPECT_EQ(SpringOracle(two, {0, 0, -1}, kPowersOfTwo).rankMargin_m(), 0.0078125);
}

TEST(SpringOracle, MeasuresTheErrorAgainstTheClosestOfAllChoicesWithinTheTie) {
  // the second of the two points is any of three that are equally far but for 0.2 um
  const std::vector<Vec3> points{{0, 0, -1.01}, {0.03, 0, -1}, {0, 0.0300001, -1}, {0, -0.0300002, -1}};
  const SpringOracle oracle(points, {0, 0, -1}, kTwoPoints);
  expectNear(oracle.force_n(), {-2.5, 0, 7.5}, kRounding);
  EXPECT_NEAR(oracle.error_n({-2.5, 0, 7.5}), 0, kRounding);
  EXPECT_NEAR(oracle.error_n({0, -2.5 + 0.5 * 500 * 1e-7, 7.5}), 0, kRounding);
  EXPECT_NEAR(oracle.error_n({0, 2.5 - 0.5 * 500 * 2e-7, 7.5}), 0, kRounding);
  EXPECT_NEAR(oracle.error_n({0, 3.5 - 0.5 * 500 * 2e-7, 7.5}), 1, kRounding);
  // with a closer tie the third is wrong, and the nearest right force is that of the first
  EXPECT_NEAR(oracle.error_n({0, 2.5, 7.5}, 5e-8), std::hypot(2.5, 2.5), kRounding);
}

TEST(SpringOracle, RefusesASceneWithMoreChoicesThanItCanTry) {
  const std::vector<Vec3> points(40, Vec3{0, 0, -1.01});
  const SpringOracle oracle(points, {0, 0, -1}, {500, 0.04, 1, 20});
  EXPECT_EQ(oracle.pointsUsed(), 20U);
  EXPECT_THROW(oracle.error_n({}), std::runtime_error);
}

}  // namespace
}  // namespace hapticd::tools
