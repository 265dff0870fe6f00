// SPDX-License-Identifier: Apache-2.0
// The closed forms against values of a brute-force computation (spacing, height and force in mm, mm and N),
// and against sums over dense lattices.

#include "tools/hapticbench/accuracy/spring_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace hapticd::tools {
namespace {

using rt::Vec3;

const rt::SpringParameters kPaper;  // 500 N/m, 0.04 m, 10, 100

TEST(SpringTruth, OfTheNearestMatchesTheTable) {
  struct Row {
    double disc_mm, height_mm, force_n;
  };
  for (const Row& row : {Row{5, 1, 6.0584},
                         {5, 5, 14.0685},
                         {5, 20, 9.6969},
                         {5, 30, 4.8630},
                         {10, 1, 3.1200},
                         {10, 5, 9.8607},
                         {10, 20, 8.8854},
                         {20, 5, 5.3078},
                         {20, 20, 6.5685}}) {
    EXPECT_NEAR(nearestSpringsAbovePlane_n(kPaper, row.disc_mm / 1000, row.height_mm / 1000), row.force_n,
                1e-4);
    EXPECT_NEAR(nearestSpringsAbovePlane_n(kPaper, row.disc_mm / 1000, -row.height_mm / 1000), -row.force_n,
                1e-4);
  }
}

TEST(SpringTruth, OfAllPointsInReachMatchesTheTable) {
  // a disc of points larger than the reach: every point within D counts
  EXPECT_NEAR(nearestSpringsAbovePlane_n(kPaper, 0.05, 0.005), 1.94444, 1e-5);
  EXPECT_NEAR(nearestSpringsAbovePlane_n(kPaper, 0.05, 0.02), 3.33333, 1e-5);
  EXPECT_NEAR(nearestSpringsAbovePlane_n(kPaper, 0.05, 0.039), 0.24684, 1e-5);
  EXPECT_EQ(nearestSpringsAbovePlane_n(kPaper, 0.05, 0.041), 0);
}

TEST(SpringTruth, PopThroughForcesMatchTheTable) {
  const auto pop_n = [](double depth_m) {
    return popThroughForce_n(kPaper, nearestDiscRadius_m({}, depth_m, kPaper.max_points));
  };
  EXPECT_NEAR(pop_n(0.8), 12.82, 0.006);
  EXPECT_NEAR(pop_n(1.0), 11.81, 0.006);
  EXPECT_NEAR(pop_n(2.0), 7.92, 0.006);
  EXPECT_NEAR(pop_n(3.5), 4.17, 0.006);
  EXPECT_NEAR(popThroughForce_n(kPaper, 0.01), 11.5697, 1e-3);
  EXPECT_NEAR(popThroughForce_n(kPaper, 0.1), 3.4315, 1e-3);
}

TEST(SpringTruth, OfSmoothSpringsMatchesTheTable) {
  EXPECT_NEAR(smoothSpringsAbovePlane_n(kPaper, 0.003), 2.4130, 1e-4);
  EXPECT_NEAR(smoothSpringsAbovePlane_n(kPaper, 0.01), 5.0000, 1e-4);
  EXPECT_NEAR(smoothSpringsAbovePlane_n(kPaper, -0.03), -3.0000, 1e-4);
  EXPECT_EQ(smoothSpringsAbovePlane_n(kPaper, 0.04), 0);
}

/// A square lattice in the plane z = 0.
std::vector<Vec3> lattice(double pitch_m) {
  std::vector<Vec3> points;
  const int half = static_cast<int>(0.045 / pitch_m);
  for (int i = -half; i <= half; ++i) {
    for (int j = -half; j <= half; ++j) points.push_back({(i + 0.3) * pitch_m, (j - 0.2) * pitch_m, 0});
  }
  return points;
}

TEST(SpringTruth, SumsOverADenseLatticeApproachTheClosedForms) {
  // 0.25 mm pitch: a disc of N points holds its area to about its rim over the pitch, sqrt(N) of N
  const double pitch_m = 0.00025;
  const std::vector<Vec3> points = lattice(pitch_m);
  rt::SpringParameters springs;
  springs.max_points = 5000;
  const double disc_m = pitch_m * std::sqrt(springs.max_points / std::numbers::pi);
  for (const double height_m : {0.003, 0.012, 0.025}) {
    const Vec3 nearest = nearestSpringsOver_n(points, {0, 0, height_m}, springs);
    const double expected_n = nearestSpringsAbovePlane_n(springs, disc_m, height_m);
    EXPECT_NEAR(nearest.z, expected_n, 0.002 * expected_n);
    EXPECT_NEAR(std::hypot(nearest.x, nearest.y), 0, 0.02);
    const Vec3 smooth = smoothSpringsOver_n(points, {0, 0, height_m}, springs);
    EXPECT_NEAR(smooth.z, smoothSpringsAbovePlane_n(springs, height_m), 0.002 * smooth.z);
  }
}

TEST(SpringTruth, IsZeroBelowTheLeastNumberOfPoints) {
  const std::vector<Vec3> nine(9, Vec3{0, 0, 0.01});
  EXPECT_EQ(nearestSpringsOver_n(nine, {}, kPaper), Vec3{});
  EXPECT_EQ(smoothSpringsOver_n(nine, {}, kPaper), Vec3{});
  const std::vector<Vec3> ten(10, Vec3{0, 0, 0.01});
  // each of ten springs of 0.04 - 0.01 m pushes away; 1e-12: rounding of their mean
  EXPECT_NEAR(nearestSpringsOver_n(ten, {}, kPaper).z, -15, 1e-12);
  EXPECT_NEAR(smoothSpringsOver_n(ten, {}, kPaper).z, -15, 1e-12);
}

TEST(SpringTruth, TakesTheExactPointsThatTheCameraSees) {
  const TrueScene scene({.kind = SceneKind::plane});
  const std::vector<Vec3> points = exactPoints_m(scene, {0, 0, -1}, 0.03, 0);
  // fx fy pixels per square metre at 1 m; the rim's pixels may fall on either side
  const double expected = std::numbers::pi * 0.03 * 0.03 * 594.214342 * 591.040537;
  EXPECT_NEAR(static_cast<double>(points.size()), expected, 2 * std::sqrt(expected));
  for (const Vec3& point : points) EXPECT_DOUBLE_EQ(point.z, -1);
}

}  // namespace
}  // namespace hapticd::tools
