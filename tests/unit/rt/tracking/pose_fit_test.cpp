// SPDX-License-Identifier: Apache-2.0
#include "rt/tracking/pose_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "tests/unit/rt/fixtures/made_grid.h"

namespace hapticd::test {
namespace {

using rt::FitEnd;
using rt::SurfacePoint;
using rt::Vec3;
using rt::Vector6;

class Random {
 public:
  double between(double lowest, double highest) {
    return std::uniform_real_distribution(lowest, highest)(engine_);
  }
  double normal() { return std::normal_distribution()(engine_); }
  Vec3 direction() {
    const Vec3 v{normal(), normal(), normal()};
    return (1 / norm(v)) * v;
  }
  std::mt19937& engine() { return engine_; }

 private:
  std::mt19937 engine_{7};
};

constexpr int kMany = 20'000;
constexpr double kPlainCondition = 1e-6;

std::vector<SurfacePoint> plate(Random& random) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < kMany; ++i)
    points.push_back({{random.between(-0.05, 0.05), random.between(-0.05, 0.05), 0}, {0, 0, 1}});
  return points;
}
std::vector<SurfacePoint> hemisphere(Random& random) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < kMany; ++i) {
    Vec3 normal = random.direction();
    normal.z = std::abs(normal.z);
    points.push_back({0.05 * normal, normal});
  }
  return points;
}
std::vector<SurfacePoint> halfCylinder(Random& random) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < kMany; ++i) {
    const double angle = random.between(0, std::numbers::pi);
    const Vec3 normal{0, std::cos(angle), std::sin(angle)};
    points.push_back({0.025 * normal + Vec3{random.between(-0.06, 0.06), 0, 0}, normal});
  }
  return points;
}
std::vector<SurfacePoint> cubeCorner(Random& random) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < kMany; ++i) {
    const double a = random.between(0, 0.1);
    const double b = random.between(0, 0.1);
    switch (i % 3) {
      case 0:
        points.push_back({{0, a, b}, {-1, 0, 0}});
        break;
      case 1:
        points.push_back({{a, 0, b}, {0, -1, 0}});
        break;
      default:
        points.push_back({{a, b, 0}, {0, 0, -1}});
    }
  }
  return points;
}

/// The zeros are exact to rounding; the others are known to three decimals and scatter with the points, by
/// 0.005 for 20,000 of them.
void expectEigenvalues(const std::vector<SurfacePoint>& points, const Vector6& expected) {
  const rt::FitGeometry geometry = rt::geometryOf(points, kPlainCondition);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(geometry.eigen.values[i], expected[i], expected[i] == 0 ? 1e-9 : 0.0055) << i;
  EXPECT_EQ(geometry.frozen, static_cast<std::size_t>(std::ranges::count(expected, 0.0)));
}

TEST(FitGeometry, HasTheEigenvaluesOfKnownSurfaces) {
  Random random;
  expectEigenvalues(plate(random), {0, 0, 0, 0.5, 0.5, 1});
  expectEigenvalues(hemisphere(random), {0, 0, 0, 0.334, 0.440, 0.448});
  expectEigenvalues(halfCylinder(random), {0, 0, 0.378, 0.387, 0.503, 0.578});
  expectEigenvalues(cubeCorner(random), {0.119, 0.120, 0.165, 0.333, 0.461, 0.467});
}

TEST(FitGeometry, NamesTheMotionsThatASurfaceDoesNotShow) {
  Random random;
  const rt::FitGeometry cylinder = rt::geometryOf(halfCylinder(random), kPlainCondition);
  ASSERT_EQ(cylinder.frozen, 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    // Along x, and about the axis, which is x through the origin: no point leaves the surface.
    const rt::SolidMotion motion = motionAlong(cylinder, i);
    const Vec3 on_axis = shiftOf({}, cylinder, motion);
    EXPECT_NEAR(std::hypot(on_axis.y, on_axis.z), 0, 1e-9);
    EXPECT_NEAR(std::hypot(motion.rotation_rad.y, motion.rotation_rad.z), 0, 1e-7);
  }
  EXPECT_EQ(rt::geometryOf({}, kPlainCondition).frozen, 6U);
}

TEST(SymmetricEigen, ReproducesTheMatrix) {
  Random random;
  for (int trial = 0; trial < 50; ++trial) {
    rt::Matrix6 a;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j <= i; ++j) a[i][j] = a[j][i] = random.normal();
    }
    const rt::SymmetricEigen eigen = rt::eigenOf(a);
    EXPECT_TRUE(std::ranges::is_sorted(eigen.values));
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) {
        double sum = 0;
        double product = 0;
        for (std::size_t k = 0; k < 6; ++k) {
          sum += eigen.values[k] * eigen.vectors[k][i] * eigen.vectors[k][j];
          product += eigen.vectors[i][k] * eigen.vectors[j][k];
        }
        EXPECT_NEAR(sum, a[i][j], 1e-12);
        EXPECT_NEAR(product, i == j ? 1 : 0, 1e-12);
      }
    }
  }
}

/// Three balls of different sizes, which look alike from nowhere, and points of their upper side.
class ThreeBalls : public testing::Test {
 protected:
  ThreeBalls() {
    Random random;
    while (points.size() < 900) {
      const rt::Shape& ball = shapes[points.size() % shapes.size()];
      Vec3 normal = random.direction();
      normal.z = std::abs(normal.z);
      const Vec3 place = ball.position_m_in_world + ball.radius_m * normal;
      if (distanceFromUnion(shapes, place) < -1e-9) continue;
      points.push_back({.place_m = truth.placeOut(place),
                        .depth_sigma_m = 0.0005,
                        .patch = static_cast<std::uint16_t>(points.size())});
    }
  }
  rt::PoseFit fit(const rt::SolidPose& start) const {
    return rt::fitPose(made.grid, points, eye_m, start, options, *sums);
  }

  const std::vector<rt::Shape> shapes{sphere({0.02, 0, 0}, 0.022), sphere({-0.02, 0.01, 0.005}, 0.017),
                                      sphere({0, -0.025, 0.008}, 0.012)};
  const MadeGrid made{[this](const Vec3& p) { return distanceFromUnion(shapes, p); }, 0.05, 0.001};
  const rt::SolidPose truth = rt::movedInSolid({.position_m = {0.03, -0.02, -0.5}}, {}, {0.1, -0.2, 0.3}, {});
  const Vec3 eye_m{};
  rt::FitOptions options{};
  std::unique_ptr<rt::PatchSums> sums = std::make_unique<rt::PatchSums>();
  std::vector<rt::TrackingPoint> points;
};

TEST_F(ThreeBalls, AreFoundFromBesideTheirPlace) {
  Random random;
  for (int trial = 0; trial < 20; ++trial) {
    const rt::PoseFit found =
        fit(rt::movedInSolid(truth, {}, 0.07 * random.direction(), 0.005 * random.direction()));
    ASSERT_EQ(found.end, FitEnd::converged);
    // Without noise there is left what a grid of 1 mm is wrong by, a fortieth of it beside the creases.
    EXPECT_LT(norm(found.pose.position_m - truth.position_m), 1e-4);
    EXPECT_LT(angleBetween_rad(found.pose, truth), 0.004);
    EXPECT_TRUE(isRigid(found.pose));
  }
}

TEST_F(ThreeBalls, AreFoundWhateverTheOrderOfThePoints) {
  Random random;
  const rt::SolidPose start =
      rt::movedInSolid(truth, {}, 0.05 * random.direction(), 0.004 * random.direction());
  const rt::PoseFit first = fit(start);
  std::ranges::shuffle(points, random.engine());
  const rt::PoseFit second = fit(start);
  EXPECT_EQ(first.used, second.used);
  EXPECT_EQ(first.iterations, second.iterations);
  EXPECT_LT(norm(first.pose.position_m - second.pose.position_m), 1e-9);
  EXPECT_LT(angleBetween_rad(first.pose, second.pose), 1e-8);
  EXPECT_NEAR(noiseAt_m(first.geometry, {}), noiseAt_m(second.geometry, {}), 1e-9);
}

TEST_F(ThreeBalls, HaveTheScatterThatTheNoiseMakesExpect) {
  // Points with independent errors along the ray: the mean square over trials of the target's error is the
  // trace of its covariance, to within four standard errors of as many trials with about three degrees of
  // freedom.
  Random random;
  const std::vector<rt::TrackingPoint> exact = points;
  const Vec3 target{0.01, 0, 0.03};
  constexpr int kTrials = 60;
  double square = 0;
  double expected = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    points = exact;
    for (rt::TrackingPoint& point : points) {
      const Vec3 ray = (-1 / point.place_m.z) * point.place_m;
      point.place_m += point.depth_sigma_m * random.normal() * ray;
    }
    const rt::PoseFit found = fit(truth);
    ASSERT_EQ(found.end, FitEnd::converged);
    const Vec3 off = found.pose.placeOut(target) - truth.placeOut(target);
    square += dot(off, off) / kTrials;
    expected += std::pow(noiseAt_m(found.geometry, target), 2) / kTrials;
  }
  const double margin = 4 * std::sqrt(2.0 / kTrials);
  EXPECT_GT(square / expected, 1 - margin);
  EXPECT_LT(square / expected, 1 + margin);
}

TEST_F(ThreeBalls, CountAsUncertainAsTheirPatchesAre) {
  // Points in groups that err together are worth as many as there are groups.
  const double alone = noiseAt_m(fit(truth).geometry, {});
  const std::vector<rt::TrackingPoint> once = points;
  for (int copy = 0; copy < 3; ++copy) points.insert(points.end(), once.begin(), once.end());
  const rt::PoseFit found = fit(truth);
  EXPECT_NEAR(found.points_per_patch, 4, 1e-9);
  EXPECT_NEAR(noiseAt_m(found.geometry, {}), alone, 0.01 * alone);
}

TEST_F(ThreeBalls, SkipWhatIsNoPoint) {
  const rt::PoseFit before = fit(truth);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  points.push_back({.place_m = {kNan, 0, 0}, .depth_sigma_m = 0.001});
  points.push_back({.place_m = truth.placeOut({0.02, 0, 0.022}), .depth_sigma_m = kNan});
  points.push_back({.place_m = truth.placeOut({0.02, 0, 0.022}), .depth_sigma_m = 0});
  points.push_back(
      {.place_m = truth.placeOut({0.02, 0, 0.022}), .depth_sigma_m = 0.001, .patch = rt::kMaxPatches});
  points.push_back({.place_m = {1e300, -1e300, 0}, .depth_sigma_m = 0.001});
  const rt::PoseFit after = fit(truth);
  EXPECT_EQ(after.used, before.used);
  EXPECT_LT(norm(after.pose.position_m - before.pose.position_m), 1e-12);
  points.clear();
  EXPECT_EQ(fit(truth).end, FitEnd::no_points);
}

}  // namespace
}  // namespace hapticd::test
