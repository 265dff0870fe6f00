// SPDX-License-Identifier: Apache-2.0
// Shapes through touched points, against shapes that are known.
#include "tools/lib/registration/shape_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "rt/base/pose.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Rounding of some hundreds of operations on numbers near 1.
constexpr double kRounding = 1e-10;
constexpr double kNoise_m = 0.0005;
constexpr double kRadPerDeg = std::numbers::pi / 180;

class ShapeFit : public testing::Test {
 protected:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vec3 noise(double sigma_m) {
    std::normal_distribution<double> normal(0, 1);
    return sigma_m * Vec3{normal(random_), normal(random_), normal(random_)};
  }
  Vec3 direction() {
    const Vec3 v = noise(1);
    return (1 / norm(v)) * v;
  }
  Vec3 place() { return {uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-1.5, -0.5)}; }

  /// Points on a square of 0.1 m about `centre`, perpendicular to `normal`.
  std::vector<Vec3> planePoints(const Vec3& centre, const Vec3& normal, double sigma_m) {
    const Vec3 across = cross(normal, std::abs(normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    const Vec3 u = (1 / norm(across)) * across;
    const Vec3 v = cross(normal, u);
    std::vector<Vec3> points;
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, 0}})
      points.push_back(centre + (0.05 * a) * u + (0.05 * b) * v + noise(sigma_m));
    return points;
  }
  std::vector<Vec3> spherePoints(const Vec3& centre, double radius_m, int count, double sigma_m) {
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) {
      Vec3 d = direction();
      d.z = std::abs(d.z);  // the half that faces the hand
      points.push_back(centre + radius_m * d + noise(sigma_m));
    }
    return points;
  }

  std::mt19937 random_{1};
};

TEST_F(ShapeFit, APlaneThroughExactPointsIsExact) {
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 centre = place();
    const Vec3 normal = direction();
    const auto fit = fitPlane(planePoints(centre, normal, 0), centre + 0.5 * normal);
    ASSERT_TRUE(fit) << fit.error().text();
    EXPECT_LT(norm(fit->normal - normal), kRounding);
    EXPECT_LT(norm(fit->position_m - centre), kRounding);
    EXPECT_LT(fit->residuals.largest_m, kRounding);
  }
}

TEST_F(ShapeFit, ThePlanesNormalPointsToTheFreeSide) {
  const auto points = planePoints({0, 0, -1}, {0, 0, 1}, 0);
  EXPECT_NEAR(fitPlane(points, {0, 0, 0})->normal.z, 1, kRounding);
  EXPECT_NEAR(fitPlane(points, {0, 0, -2})->normal.z, -1, kRounding);
}

// The angle's standard deviation is noise / (spread * sqrt(points)): 0.5 mm / (45 mm * sqrt(5)) = 5 mrad in
// each of two directions; 5 of them are 25 mrad.
TEST_F(ShapeFit, APlaneThroughNoisyPointsIsNearAndShowsTheNoise) {
  double squares = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto fit = fitPlane(planePoints({0, 0, -1}, {0, 0, 1}, kNoise_m), {});
    ASSERT_TRUE(fit);
    EXPECT_LT(std::acos(fit->normal.z), 0.025);
    EXPECT_NEAR(fit->position_m.z, -1, 5 * kNoise_m / std::sqrt(5));
    EXPECT_LE(fit->residuals.rms_m, fit->residuals.largest_m);
    squares += fit->residuals.rms_m * fit->residuals.rms_m;
  }
  // three of five degrees of freedom are fitted; 400 remaining ones scatter by 7 %
  EXPECT_NEAR(squares / 200, 2.0 / 5 * kNoise_m * kNoise_m, 0.3 * 2.0 / 5 * kNoise_m * kNoise_m);
}

TEST_F(ShapeFit, APlaneIsRefusedOnALineAndOfTwoPoints) {
  const std::vector<Vec3> line{{0, 0, -1}, {0.1, 0, -1}, {0.2, 0.001, -1}};
  const auto on_line = fitPlane(line, {});
  ASSERT_FALSE(on_line);
  EXPECT_NE(on_line.error().what.find("lie on a line"), std::string::npos);
  EXPECT_NE(on_line.error().remedy, "");
  EXPECT_FALSE(fitPlane(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}, {}));
  EXPECT_FALSE(fitPlane(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, std::nan("")}}, {}));
  EXPECT_FALSE(fitPlane(std::vector<Vec3>(5, Vec3{0, 0, -1}), {}));
}

TEST_F(ShapeFit, ASphereThroughExactPointsIsExact) {
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 centre = place();
    const double radius_m = uniform(0.02, 0.2);
    const auto fit = fitSphere(spherePoints(centre, radius_m, 12, 0));
    ASSERT_TRUE(fit) << fit.error().text();
    EXPECT_LT(norm(fit->position_m - centre), kRounding);
    EXPECT_NEAR(fit->radius_m, radius_m, kRounding);
    EXPECT_LT(fit->residuals.largest_m, kRounding);
  }
}

TEST_F(ShapeFit, ASphereThroughFourPointsPassesThroughThem) {
  const std::vector<Vec3> points{{0.1, 0, -1}, {-0.1, 0, -1}, {0, 0.1, -1}, {0, 0, -0.9}};
  const auto fit = fitSphere(points);
  ASSERT_TRUE(fit);
  EXPECT_LT(norm(fit->position_m - Vec3{0, 0, -1}), kRounding);
  EXPECT_NEAR(fit->radius_m, 0.1, kRounding);
}

// The fit refuses where noise of 0.5 mm moves a coordinate by more than 5 mm; with 12 points on a half it is
// well below a millimetre, and 5 of them are within 3 mm.
TEST_F(ShapeFit, ASphereThroughNoisyPointsIsNear) {
  for (int trial = 0; trial < 200; ++trial) {
    const auto fit = fitSphere(spherePoints({0, 0, -1}, 0.05, 12, kNoise_m));
    ASSERT_TRUE(fit);
    EXPECT_LT(norm(fit->position_m - Vec3{0, 0, -1}), 0.003);
    EXPECT_NEAR(fit->radius_m, 0.05, 0.003);
    EXPECT_LT(fit->residuals.rms_m, 2 * kNoise_m);
    EXPECT_GT(fit->residuals.rms_m, 0);
  }
}

// At a minimum of the sum of squares, no small change of the sphere makes it smaller.
TEST_F(ShapeFit, ASphereHasTheLeastSumOfSquaredDistances) {
  const auto points = spherePoints({0, 0, -1}, 0.05, 9, 0.002);
  const auto fit = fitSphere(points);
  ASSERT_TRUE(fit);
  const auto squaresOf = [&](const Vec3& centre, double radius_m) {
    double squares = 0;
    for (const Vec3& point : points) squares += std::pow(norm(point - centre) - radius_m, 2);
    return squares;
  };
  const double least = squaresOf(fit->position_m, fit->radius_m);
  EXPECT_NEAR(least, 9 * fit->residuals.rms_m * fit->residuals.rms_m, 1e-15);
  for (int trial = 0; trial < 100; ++trial) {
    EXPECT_GT(squaresOf(fit->position_m + noise(1e-5), fit->radius_m + uniform(-1e-5, 1e-5)), least);
  }
}

TEST_F(ShapeFit, ASphereIsRefusedOfPointsInAPlaneAndOnASmallCap) {
  std::vector<Vec3> circle;
  std::vector<Vec3> cap;
  for (int i = 0; i < 8; ++i) {
    const double angle = i * std::numbers::pi / 4;
    circle.push_back({0.05 * std::cos(angle), 0.05 * std::sin(angle), -1});
    const double polar = i % 2 == 0 ? 0.0 : 0.25;  // radians from the top of a sphere of 0.2 m
    cap.push_back(
        0.2 * Vec3{std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar)});
  }
  const auto flat = fitSphere(circle);
  ASSERT_FALSE(flat);
  EXPECT_NE(flat.error().what.find("lie in a plane"), std::string::npos);
  const auto small = fitSphere(cap);
  ASSERT_FALSE(small);
  EXPECT_NE(small.error().what.find("so little of the sphere"), std::string::npos);
  EXPECT_NE(small.error().remedy, "");
  EXPECT_FALSE(fitSphere(std::span(circle).first(3)));
}

/// A corner of a box of this size in its own frame, moved to the world.
Vec3 cornerOf(const rt::PoseParameters& pose, const Vec3& size, double x, double y, double z) {
  const auto r = rt::rotationOf(pose);
  const Vec3 p{x * size.x / 2, y * size.y / 2, z * size.z / 2};
  return pose.position_m + Vec3{r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
                                r[6] * p.x + r[7] * p.y + r[8] * p.z};
}

TEST_F(ShapeFit, ABoxHasTheCornersThatWereTouched) {
  const double pi = std::numbers::pi;
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 size{uniform(0.01, 0.2), uniform(0.01, 0.2), uniform(0.01, 0.2)};
    const rt::PoseParameters pose{place(), uniform(-pi, pi), uniform(-1.5, 1.5), uniform(-pi, pi)};
    const double face = trial % 2 == 0 ? 1 : -1;
    const std::array corners{cornerOf(pose, size, -1, -1, face), cornerOf(pose, size, 1, -1, face),
                             cornerOf(pose, size, 1, 1, face)};
    const auto fit = fitBox(corners, cornerOf(pose, size, 0.3, -0.2, -face));
    ASSERT_TRUE(fit) << fit.error().text();
    EXPECT_LT(norm(fit->position_m - pose.position_m), kRounding);
    EXPECT_LT(norm(fit->size_m - size), kRounding);
    EXPECT_LT(fit->residuals.largest_m, kRounding);
    const rt::PoseParameters found{fit->position_m, kRadPerDeg * fit->rotation_deg.x,
                                   kRadPerDeg * fit->rotation_deg.y, kRadPerDeg * fit->rotation_deg.z};
    for (const Vec3& corner : corners) {
      double nearest_m = 1;
      for (const double x : {-1, 1})
        for (const double y : {-1, 1})
          for (const double z : {-1, 1})
            nearest_m = std::fmin(nearest_m, norm(corner - cornerOf(found, fit->size_m, x, y, z)));
      EXPECT_LT(nearest_m, 1e-9);
    }
  }
}

// Noise of both ends of an edge of 0.1 m and of half the angle's correction: within 5 standard deviations.
TEST_F(ShapeFit, ABoxOfNoisyCornersIsNear) {
  for (int trial = 0; trial < 200; ++trial) {
    const std::array corners{Vec3{0.1, 0, -1} + noise(kNoise_m), Vec3{0, 0, -1} + noise(kNoise_m),
                             Vec3{0, 0.1, -1} + noise(kNoise_m)};
    const auto fit = fitBox(corners, Vec3{0.05, 0.05, -1.05} + noise(kNoise_m));
    ASSERT_TRUE(fit);
    EXPECT_LT(norm(fit->size_m - Vec3{0.1, 0.1, 0.05}), 0.007);
    EXPECT_LT(norm(fit->position_m - Vec3{0.05, 0.05, -1.025}), 0.007);
    EXPECT_LT(fit->residuals.largest_m, 0.003);
  }
}

// Edges of 0.1 m at 84 degrees instead of 90: each is turned by 3 degrees.
TEST_F(ShapeFit, ABoxShowsHowFarItsCornerIsFromARightAngle) {
  const double angle = 84 * kRadPerDeg;
  const auto fit =
      fitBox({Vec3{0.1, 0, 0}, Vec3{}, Vec3{0.1 * std::cos(angle), 0.1 * std::sin(angle), 0}}, {0, 0, 0.05});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->residuals.each_m[0], 0.1 * std::sin(3 * kRadPerDeg), kRounding);
  EXPECT_NEAR(fit->residuals.each_m[2], 0.1 * std::sin(3 * kRadPerDeg), kRounding);
}

TEST_F(ShapeFit, ABoxIsRefusedOfPointsThatAreTooNearOrOnALine) {
  const Vec3 a{0.1, 0, 0};
  const Vec3 c{0, 0.1, 0};
  EXPECT_NE(fitBox({a, a + Vec3{0.001, 0, 0}, c}, {0, 0, 0.1}).error().what.find("corner 1 to corner 2"),
            std::string::npos);
  EXPECT_NE(fitBox({a, c + Vec3{0.001, 0, 0}, c}, {0, 0, 0.1}).error().what.find("corner 2 to corner 3"),
            std::string::npos);
  EXPECT_NE(fitBox({a, {}, c}, {0.02, 0.02, 0.001}).error().what.find("opposite face"), std::string::npos);
  EXPECT_NE(fitBox({a, {}, {-0.1, 0.001, 0}}, {0, 0, 0.1}).error().what.find("on a line"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
