// SPDX-License-Identifier: Apache-2.0
// Camera-to-world registration against poses that are known.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "rt/pose.h"
#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {
namespace {

using rt::PoseParameters;
using rt::Vec3;

/// Rounding of some dozens of operations on numbers below 10.
constexpr double kRounding = 1e-12;

Vec3 moved(const PoseParameters& pose, const Vec3& p) {
  const auto r = rt::rotationOf(pose);
  return pose.position_m + Vec3{r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
                                r[6] * p.x + r[7] * p.y + r[8] * p.z};
}

class Registration : public testing::Test {
 protected:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vec3 point() { return {uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-1.5, -0.5)}; }
  PoseParameters pose() {
    const double pi = std::numbers::pi;
    return {{uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)},
            uniform(-pi, pi),
            uniform(-pi / 2, pi / 2),
            uniform(-pi, pi)};
  }
  std::vector<PointPair> pairsOf(const PoseParameters& truth, int count) {
    std::vector<PointPair> pairs;
    for (int i = 0; i < count; ++i) {
      const Vec3 camera = point();
      pairs.push_back({std::to_string(i), camera, moved(truth, camera)});
    }
    return pairs;
  }
  std::mt19937 random_{1};
};

/// Largest difference of two rotation matrices' numbers; the angles need not agree in gimbal lock.
double difference(const PoseParameters& a, const PoseParameters& b) {
  double largest = rt::norm(a.position_m - b.position_m);
  const auto rows_a = rt::rotationOf(a);
  const auto rows_b = rt::rotationOf(b);
  for (std::size_t i = 0; i < rows_a.size(); ++i)
    largest = std::fmax(largest, std::abs(rows_a[i] - rows_b[i]));
  return largest;
}

TEST_F(Registration, FindsRandomPosesExactlyFromThreeAndMorePoints) {
  for (int trial = 0; trial < 300; ++trial) {
    const PoseParameters truth = pose();
    const auto fit = fitRigid(pairsOf(truth, 3 + trial % 5));
    if (!fit) continue;  // three random points may lie nearly on a line
    EXPECT_LT(difference(truth, fit->T_world_camera), 1e3 * kRounding);
    EXPECT_LT(fit->largest_m, 1e3 * kRounding);
    EXPECT_NEAR(truth.roll_rad, fit->T_world_camera.roll_rad, 1e-9);
    EXPECT_NEAR(truth.pitch_rad, fit->T_world_camera.pitch_rad, 1e-9);
    EXPECT_NEAR(truth.yaw_rad, fit->T_world_camera.yaw_rad, 1e-9);
  }
}

TEST_F(Registration, FindsPosesInGimbalLock) {
  for (const double pitch_rad : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
    PoseParameters truth = pose();
    truth.pitch_rad = pitch_rad;
    const auto fit = fitRigid(pairsOf(truth, 6));
    ASSERT_TRUE(fit);
    // the cosine of pi/2 in doubles is 6e-17, below what counts as locked
    EXPECT_LT(difference(truth, fit->T_world_camera), 1e-8);
  }
}

// Points of a plane are their own mirror image up to a turn; a fit that allowed reflections would take one.
TEST_F(Registration, NeverMirrors) {
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<PointPair> pairs = pairsOf(pose(), 5);
    for (PointPair& pair : pairs) pair.world_m.x = -pair.world_m.x;
    const auto fit = fitRigid(pairs);
    ASSERT_TRUE(fit);
    const auto r = rt::rotationOf(fit->T_world_camera);
    const double determinant = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                               r[2] * (r[3] * r[7] - r[4] * r[6]);
    EXPECT_NEAR(determinant, 1, 1e-9);
    EXPECT_GT(fit->largest_m, 1e-3);  // exact would be a mirror image
  }
}

TEST_F(Registration, HandlesPointsOfAPlane) {
  const PoseParameters truth = pose();
  std::vector<PointPair> pairs;
  for (const Vec3& camera : {Vec3{0, 0, -1}, {0.4, 0, -1}, {0, 0.3, -1}, {0.4, 0.3, -1}}) {
    pairs.push_back({"corner", camera, moved(truth, camera)});
  }
  const auto fit = fitRigid(pairs);
  ASSERT_TRUE(fit);
  EXPECT_LT(difference(truth, fit->T_world_camera), 1e3 * kRounding);
}

// Oracle: with noise of standard deviation s on each world coordinate of n points, the sum of squared
// residuals has 3 n - 6 degrees of freedom: the root mean square distance is s sqrt((3 n - 6) / n) on
// average.
TEST_F(Registration, LeavesAsMuchAsTheNoiseOverMany) {
  constexpr double kNoise_m = 0.002;
  constexpr int kPoints = 20;
  constexpr int kTrials = 400;
  std::normal_distribution noise(0.0, kNoise_m);
  double sum_of_squares = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PointPair> pairs = pairsOf(pose(), kPoints);
    for (PointPair& pair : pairs) pair.world_m += Vec3{noise(random_), noise(random_), noise(random_)};
    const auto fit = fitRigid(pairs);
    ASSERT_TRUE(fit);
    sum_of_squares += fit->rms_m * fit->rms_m;
  }
  const double expected_m = kNoise_m * std::sqrt((3.0 * kPoints - 6) / kPoints);
  // chi squared with 400 * 54 degrees of freedom: its root is within 2 % by four standard deviations
  EXPECT_NEAR(std::sqrt(sum_of_squares / kTrials), expected_m, 0.02 * expected_m);
}

// Oracle: no small turn or shift of the result fits better.
TEST_F(Registration, IsTheBestOfItsNeighbourhood) {
  std::vector<PointPair> pairs = pairsOf(pose(), 8);
  for (PointPair& pair : pairs) pair.world_m += 0.02 * point();
  const auto fit = fitRigid(pairs);
  ASSERT_TRUE(fit);
  const auto costOf = [&](const PoseParameters& pose) {
    double cost = 0;
    for (const PointPair& pair : pairs)
      cost += std::pow(rt::norm(moved(pose, pair.camera_m) - pair.world_m), 2);
    return cost;
  };
  const double best = costOf(fit->T_world_camera);
  for (int trial = 0; trial < 200; ++trial) {
    PoseParameters other = fit->T_world_camera;
    other.position_m += 1e-3 * point();
    other.roll_rad += uniform(-1e-3, 1e-3);
    other.pitch_rad += uniform(-1e-3, 1e-3);
    other.yaw_rad += uniform(-1e-3, 1e-3);
    EXPECT_GE(costOf(other), best);
  }
}

TEST_F(Registration, RefusesTooFewPointsAndPointsOnALine) {
  EXPECT_NE(fitRigid(pairsOf(pose(), 2)).error().what.find("2 point pairs, at least 3"), std::string::npos);
  std::vector<PointPair> line;
  for (int i = 0; i < 5; ++i) line.push_back({"", {0.1 * i, 0, -1}, {0.1 * i, 0, -1}});
  EXPECT_NE(fitRigid(line).error().what.find("lie on a line: 0.0 mm across it"), std::string::npos);
  line.back().camera_m.y = 0.2;  // now only the world's are
  EXPECT_NE(fitRigid(line).error().what.find("the world's points lie on a line"), std::string::npos);
}

TEST_F(Registration, RefusesNumbersThatAreNotFinite) {
  std::vector<PointPair> pairs = pairsOf(pose(), 4);
  pairs[2].world_m.y = std::nan("");
  const auto fit = fitRigid(pairs);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().where, "2");
}

}  // namespace
}  // namespace hapticd::tools
