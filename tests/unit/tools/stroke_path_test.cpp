// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/touch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "config/additions/addition_checks.h"
#include "rt/fixtures/fixture.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kTolerance_m = 0.001;

/// Readings on a helix of radius 0.05 m and a rise of 0.02 m each turn.
std::vector<Vec3> helix(double turns, double noise_m) {
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> normal(0, 1);
  std::vector<Vec3> readings;
  for (double angle = 0; angle < turns * 2 * std::numbers::pi; angle += 0.05) {
    const Vec3 off = noise_m * Vec3{normal(random), normal(random), normal(random)};
    readings.push_back(
        Vec3{0.05 * std::cos(angle), 0.05 * std::sin(angle), 0.02 * angle / (2 * std::numbers::pi)} + off);
  }
  return readings;
}

TEST(StrokePath, AStraightStrokeIsTwoPoints) {
  std::vector<Vec3> readings;
  for (int i = 0; i <= 100; ++i) readings.push_back({0.001 * i * i / 100, 0, -1});
  const auto path = pathOf(readings, kTolerance_m);
  ASSERT_TRUE(path);
  ASSERT_EQ(path->points_m.size(), 2U);
  EXPECT_LT(norm(path->points_m[0] - readings.front()), 1e-12);
  EXPECT_LE(norm(path->points_m[1] - readings.back()), kStrokeStep_m);
  EXPECT_NEAR(path->length_m, 0.1, kStrokeStep_m);
  EXPECT_LT(path->residuals.rms_m, kStrokeStep_m);
}

TEST(StrokePath, KeepsTheCornerOfAStroke) {
  std::vector<Vec3> readings;
  for (int i = 0; i <= 20; ++i) readings.push_back({0.005 * i, 0, -1});
  for (int i = 1; i <= 20; ++i) readings.push_back({0.1, 0.005 * i, -1});
  const auto path = pathOf(readings, kTolerance_m);
  ASSERT_TRUE(path);
  ASSERT_EQ(path->points_m.size(), 3U);
  EXPECT_LT(norm(path->points_m[1] - Vec3{0.1, 0, -1}), kStrokeStep_m);
}

TEST(StrokePath, StaysWithinItsToleranceOfTheStroke) {
  const auto path = pathOf(helix(3, 0), kTolerance_m);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->tolerance_m, kTolerance_m);
  // a chord between readings of 2.5 mm lies 0.02 mm inside the circle
  EXPECT_LT(path->residuals.largest_m, kTolerance_m + 3e-5);
  EXPECT_GT(path->points_m.size(), 20U);
  EXPECT_LT(path->points_m.size(), 150U);
  EXPECT_FALSE(config::pathProblem(path->points_m, false));
}

TEST(StrokePath, OfATremblingHandIsAPathThatTheDaemonTakes) {
  const auto path = pathOf(helix(2, 1e-4), kTolerance_m);
  ASSERT_TRUE(path);
  EXPECT_FALSE(config::pathProblem(path->points_m, false));
  EXPECT_LT(path->residuals.largest_m, kTolerance_m + 6e-4) << "5 standard deviations more";
}

TEST(StrokePath, WidensItsToleranceWhereItTakesTooManyPoints) {
  const auto path = pathOf(helix(30, 0), 1e-4);
  ASSERT_TRUE(path);
  EXPECT_LE(path->points_m.size(), rt::kMaxPathPoints);
  EXPECT_GT(path->tolerance_m, 1e-4);
  EXPECT_LT(path->residuals.largest_m, path->tolerance_m + 3e-5);
}

TEST(StrokePath, ARestingHandAddsNothingToTheLength) {
  std::vector<Vec3> readings(500, Vec3{0, 0, -1});
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].x = i % 2 == 0 ? 0.0004 : -0.0004;
  const auto still = pathOf(readings, kTolerance_m);
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().what.find("the stroke is 0.0 mm long"), std::string::npos);
  EXPECT_NE(still.error().remedy, "");
}

TEST(StrokePath, NoReadingsAndBadReadingsAreRefused) {
  EXPECT_FALSE(pathOf({}, kTolerance_m));
  EXPECT_FALSE(pathOf(std::vector<Vec3>{{0, 0, 0}, {0.1, std::nan(""), 0}}, kTolerance_m));
}

}  // namespace
}  // namespace hapticd::tools
