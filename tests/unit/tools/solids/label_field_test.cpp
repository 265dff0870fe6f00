// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/field/distance_transform.h"
#include "tools/lib/solids/field/label_field.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;

// Label maps of bodies whose signed distance is known in closed form.

constexpr double kRadius_m = 0.020;

/// A sphere about a place that no grid favours, in voxels with these steps.
LabelMap sphereIn(const std::array<Vec3, 3>& steps_m, const Vec3& centre_m, double radius_m = kRadius_m) {
  std::array<int, 3> size{};
  Vec3 origin = centre_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int half = static_cast<int>(std::ceil(1.1 * radius_m / norm(steps_m[axis]))) + 1;
    size[axis] = 2 * half + 1;
    origin = origin - (half + 0.29 + 0.1 * static_cast<double>(axis)) * steps_m[axis];
  }
  return test::labelsOf([=](const Vec3& p) { return norm(p - centre_m) - radius_m; }, size, steps_m, origin);
}

Vec3 randomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Vec3 v{normal(random), normal(random), normal(random)};
  return (1 / norm(v)) * v;
}

/// Mean and root mean square of the field on the true sphere, and the angle of its normal there.
struct SphereErrors {
  double bias_m = 0, rms_m = 0, median_deg = 0, p95_deg = 0;
};
SphereErrors errorsOf(const SampledField& field, const Vec3& centre_m, double radius_m) {
  constexpr int kPlaces = 4000;
  std::mt19937_64 random(1);
  SphereErrors errors;
  std::vector<double> angles;
  for (int i = 0; i < kPlaces; ++i) {
    const Vec3 outward = randomDirection(random), place = centre_m + radius_m * outward;
    const double value = trilinearValue(field, place);
    errors.bias_m += value / kPlaces;
    errors.rms_m += value * value / kPlaces;
    const double step = field.spacing_m / 4;
    const auto slope = [&](const Vec3& d) {
      return trilinearValue(field, place + d) - trilinearValue(field, place - d);
    };
    const Vec3 gradient{slope({step, 0, 0}), slope({0, step, 0}), slope({0, 0, step})};
    angles.push_back(std::acos(std::clamp(dot(gradient, outward) / norm(gradient), -1.0, 1.0)) * 180 /
                     std::numbers::pi);
  }
  errors.rms_m = std::sqrt(errors.rms_m);
  std::ranges::sort(angles);
  errors.median_deg = angles[kPlaces / 2];
  errors.p95_deg = angles[kPlaces * 95 / 100];
  return errors;
}

FieldOptions within(double tolerance_m) {
  FieldOptions options;
  options.tolerance_m = tolerance_m;
  return options;
}

/// The bounds are measured ones of another implementation, at as many places (40,000), smoothed by one voxel:
/// rms 0.08 mm, normals 2.6 and 6.7 degrees at 1 mm. A quarter is added for the places, which are others. The
/// bias is the mean of sigma^2 / 2 times the second derivative along each axis, a third of the sum of sigma^2
/// / R.
TEST(LabelField, OfASphereHasTheBiasAndTheNormalsThatSmoothingLeaves) {
  const Vec3 centre{0.1013, -0.0207, 0.0311};
  struct Case {
    std::array<Vec3, 3> steps_m;
    double bias_m, rms_m;
  };
  for (const Case& c : {Case{{Vec3{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}}, 0.00006, 0.00008},
                        Case{{Vec3{-0.0005, 0, 0}, {0, 0.0005, 0}, {0, 0, 0.00125}}, 0.000034, 0.00008}}) {
    const auto result = fieldOfLabel(sphereIn(c.steps_m, centre), "sphere", within(0.0005));
    ASSERT_TRUE(result) << result.error().text();
    const SphereErrors errors = errorsOf(result->field, centre, kRadius_m);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_DOUBLE_EQ(result->smoothing_m[axis], norm(c.steps_m[axis]));
    EXPECT_GT(errors.bias_m, 0);  // convex: it shrinks
    EXPECT_NEAR(errors.bias_m, c.bias_m, 0.00003);
    EXPECT_LE(errors.bias_m, result->bias_bound_m);
    EXPECT_LE(errors.rms_m, 1.25 * c.rms_m);
    EXPECT_LE(errors.median_deg, 1.25 * 2.6);
    EXPECT_LE(errors.p95_deg, 1.25 * 6.7);
    EXPECT_LE(result->report.surface.max_m, 0.0005);
    EXPECT_EQ(result->lost_share, 0);
  }
}

/// Slices of 5 mm must not take anything off a vessel along them: across, it is smoothed by 0.7 mm only.
TEST(LabelField, OfThickSlicesIsSmoothedByTheVoxelOfEachAxis) {
  constexpr double kVessel_m = 0.004;
  for (const std::size_t along : {0U, 1U, 2U}) {
    const auto across = [&](const Vec3& p) {
      return along == 0 ? std::hypot(p.y, p.z) : along == 1 ? std::hypot(p.z, p.x) : std::hypot(p.x, p.y);
    };
    std::array<Vec3, 3> steps_m{Vec3{0.0007, 0, 0}, {0, 0.0007, 0}, {0, 0, 0.0007}};
    std::array<int, 3> size{18, 18, 18};
    steps_m[along] = (0.005 / 0.0007) * steps_m[along];
    const Vec3 first = -8.7 * (steps_m[0] + steps_m[1] + steps_m[2]);
    const auto result = fieldOfLabel(
        test::labelsOf([&](const Vec3& p) { return across(p) - kVessel_m; }, size, steps_m, first), "vessel",
        within(0.0005));
    ASSERT_TRUE(result) << result.error().text();
    double radii_m = 0;
    constexpr int kPlaces = 100;
    for (int i = 0; i < kPlaces; ++i) {
      const double angle = 2 * std::numbers::pi * i / kPlaces, a = kVessel_m * std::cos(angle),
                   b = kVessel_m * std::sin(angle);
      radii_m += (kVessel_m - trilinearValue(result->field, along == 0   ? Vec3{0, a, b}
                                                            : along == 1 ? Vec3{b, 0, a}
                                                                         : Vec3{a, b, 0})) /
                 kPlaces;
    }
    // sigma^2 / 2R of 0.7 mm, and a twentieth of a millimetre for the voxels
    EXPECT_NEAR(radii_m, kVessel_m - 0.0007 * 0.0007 / (2 * kVessel_m), 0.00005) << along;
  }
}

TEST(LabelField, StatesABiasThatHoldsForSmallBodiesToo) {
  const Vec3 centre{0.0013, -0.0007, 0.0011};
  for (const double radius_m : {0.005, 0.008, 0.015}) {
    const std::array<Vec3, 3> steps{Vec3{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}};
    const auto result = fieldOfLabel(sphereIn(steps, centre, radius_m), "sphere", within(0.0005));
    ASSERT_TRUE(result) << result.error().text();
    const SphereErrors errors = errorsOf(result->field, centre, radius_m);
    // sigma^2 / R is the first order; the voxels themselves add a twentieth of one
    EXPECT_NEAR(errors.bias_m, 1e-6 / radius_m, 0.00005);
    EXPECT_LE(errors.bias_m, result->bias_bound_m + 0.00005) << radius_m;
  }
}

TEST(LabelField, LiesWhereTheVoxelsAreHoweverTheirAxesPoint) {
  const double c = std::cos(0.4), s = std::sin(0.4), h = 0.001;
  const Vec3 centre{-0.05, 0.12, -0.3};
  const std::vector<std::array<Vec3, 3>> axes{{Vec3{h, 0, 0}, {0, h, 0}, {0, 0, h}},
                                              {Vec3{0, 0, -h}, {h, 0, 0}, {0, h, 0}},
                                              {Vec3{c * h, s * h, 0}, {-s * h, c * h, 0}, {0, 0, h}},
                                              {Vec3{c * h, 0, s * h}, {0, -h, 0}, {-s * h, 0, c * h}},
                                              // a gantry that was tilted: the axes are not orthogonal
                                              {Vec3{h, 0, 0}, {0, h, 0}, {0, 0.3 * h, h}}};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto result = fieldOfLabel(sphereIn(axes[i], centre), "sphere", within(0.0005));
    ASSERT_TRUE(result) << i << ": " << result.error().text();
    const SphereErrors errors = errorsOf(result->field, centre, kRadius_m);
    EXPECT_NEAR(errors.bias_m, 0.00006, 0.00003) << i;
    const bool is_resampled = i == 4;  // its axes are not orthogonal: the boundary is rounded twice
    EXPECT_LE(errors.p95_deg, 1.25 * 6.7 * (is_resampled ? std::sqrt(2) : 1)) << i;
    // and everywhere else
    const SampledField& field = result->field;
    double off_near_m = 0, off_m = 0;
    for (int z = 0; z < field.samples[2]; ++z)
      for (int y = 0; y < field.samples[1]; ++y)
        for (int x = 0; x < field.samples[0]; ++x) {
          const double truth = norm(field.placeOf(x, y, z) - centre) - kRadius_m;
          const double off = std::abs(static_cast<double>(field.distance_m[field.indexOf(x, y, z)]) - truth);
          off_m = std::max(off_m, off);
          if (std::abs(truth) < 0.015) off_near_m = std::max(off_near_m, off);
        }
    // half the longest diagonal of a voxel, and of a resampled one
    const double diagonal_m = norm(axes[i][0] + axes[i][1] + axes[i][2]);
    const double near_m =
        std::max(diagonal_m, std::sqrt(3) * h) / 2 + (is_resampled ? std::sqrt(3) / 2 * h : 0);
    EXPECT_LE(off_near_m, near_m) << i;
    // at the centre the distance has a peak, where smoothing takes the mean distance of a Gaussian from its
    // centre
    EXPECT_LE(off_m, near_m + std::sqrt(8 / std::numbers::pi) * result->smoothing_m[0]) << i;
  }
}

TEST(LabelField, SaysWhatIsLostBecauseItIsTooThin) {
  const double h = 0.001;
  // a ball with a sheet of one voxel that sticks out of it by 25 mm
  const auto body = [&](const Vec3& p) {
    const bool in_sheet = std::abs(p.z) < 0.6 * h && std::abs(p.x) < 0.035 && std::abs(p.y) < 0.006;
    return norm(p) < 0.010 || in_sheet ? -1.0 : 1.0;
  };
  const LabelMap map =
      test::labelsOf(body, {80, 40, 40}, {Vec3{h, 0, 0}, {0, h, 0}, {0, 0, h}}, {-0.040, -0.020, -0.020});
  const auto result = fieldOfLabel(map, "ball with sheet", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  ASSERT_TRUE(result->lost);
  EXPECT_GT(std::abs(result->lost->place_m.x), 0.011);
  EXPECT_LT(std::abs(result->lost->place_m.z), h);
  EXPECT_GT(result->lost_share, 0.02);
  ASSERT_EQ(result->report.warnings.size(), 1U);
  const LabelMap sheet = test::labelsOf(
      [&](const Vec3& p) { return std::abs(p.z) < 0.6 * h && std::abs(p.x) < 0.015 ? -1.0 : 1.0; },
      {40, 40, 10}, {Vec3{h, 0, 0}, {0, h, 0}, {0, 0, h}}, {-0.020, -0.020, -0.005});
  const auto lost = fieldOfLabel(sheet, "sheet", within(0.0005));
  ASSERT_FALSE(lost);
  EXPECT_NE(lost.error().what.find("thin"), std::string::npos);
}

TEST(LabelField, IsCoarserThanTheVoxelsWhereTheLimitsRequireThat) {
  FieldOptions options = within(0.001);
  options.limits.samples_per_axis = 48;
  const Vec3 centre{0, 0, 0};
  const auto result =
      fieldOfLabel(sphereIn({Vec3{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}}, centre), "sphere", options);
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_GT(result->field.spacing_m, 0.001);
  for (const int samples : result->field.samples) EXPECT_LE(samples, 48);
  EXPECT_NEAR(errorsOf(result->field, centre, kRadius_m).bias_m,
              std::pow(result->smoothing_m[0], 2) / kRadius_m, 0.0001);
  options.limits.samples_per_axis = 20;
  EXPECT_FALSE(
      fieldOfLabel(sphereIn({Vec3{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}}, centre), "sphere", options));
}

TEST(LabelField, WithoutAVoxelIsRefused) {
  LabelMap map{
      {2, 2, 2}, {Vec3{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}}, {}, std::vector<std::uint8_t>(8)};
  EXPECT_FALSE(fieldOfLabel(map, "nothing"));
  map.inside.resize(7);
  EXPECT_FALSE(fieldOfLabel(map, "wrong size"));
}

std::size_t indexOf(const GridSize& size, int x, int y, int z) {
  return static_cast<std::size_t>(x + size[0] * (y + size[1] * z));
}
std::size_t countOf(const GridSize& size) {
  return static_cast<std::size_t>(size[0] * size[1] * size[2]);
}

TEST(DistanceTransform, GivesSquaredDistancesWorkedOutByHand) {
  const GridSize size{5, 4, 3};
  std::vector<std::uint8_t> seeds(countOf(size));
  seeds[indexOf(size, 1, 1, 1)] = seeds[indexOf(size, 4, 3, 2)] = 1;
  const std::vector<float> expected{6, 5, 6, 9, 14, 5, 4, 5, 8, 13, 6, 5, 6, 9, 14, 9, 8, 9, 12, 16,  //
                                    2, 1, 2, 5, 10, 1, 0, 1, 4, 8,  2, 1, 2, 5, 5,  5, 4, 5, 5,  4,   //
                                    6, 5, 6, 9, 9,  5, 4, 5, 5, 4,  6, 5, 5, 2, 1,  9, 8, 4, 1,  0};
  EXPECT_EQ(squaredDistances(seeds, size, {1, 1, 2}), expected);
}

TEST(DistanceTransform, AgreesWithASearchOfAllSeeds) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 30; ++trial) {
    const auto among = [&](int low, int high) {
      return std::uniform_int_distribution<int>(low, high)(random);
    };
    const GridSize size{among(1, 9), among(1, 9), among(1, 9)};
    const std::array<double, 3> spacing{0.5 * among(1, 4), 0.5 * among(1, 4), 0.5 * among(1, 4)};
    std::vector<std::uint8_t> seeds(countOf(size));
    for (int i = among(1, 6); i > 0; --i)
      seeds[static_cast<std::size_t>(among(0, static_cast<int>(seeds.size()) - 1))] = 1;
    const std::vector<float> found = squaredDistances(seeds, size, spacing);
    for (int z = 0; z < size[2]; ++z)
      for (int y = 0; y < size[1]; ++y)
        for (int x = 0; x < size[0]; ++x) {
          double least = std::numeric_limits<double>::infinity();
          for (int k = 0; k < size[2]; ++k)
            for (int j = 0; j < size[1]; ++j)
              for (int i = 0; i < size[0]; ++i)
                if (seeds[indexOf(size, i, j, k)] != 0)
                  least =
                      std::min(least, std::pow(spacing[0] * (x - i), 2) + std::pow(spacing[1] * (y - j), 2) +
                                          std::pow(spacing[2] * (z - k), 2));
          // multiples of a quarter are exact in floats
          EXPECT_EQ(static_cast<double>(found[indexOf(size, x, y, z)]), least);
        }
  }
}

TEST(DistanceTransform, WithoutSeedsIsInfinite) {
  for (const float value : squaredDistances(std::vector<std::uint8_t>(8), {2, 2, 2}, {1, 1, 1}))
    EXPECT_TRUE(std::isinf(value));
}

TEST(SignedDistance, HasItsBoundaryHalfASpacingOffTheSamples) {
  const std::vector<std::uint8_t> labels{0, 0, 1, 1, 1, 0, 0};
  EXPECT_EQ(signedDistances(labels, {7, 1, 1}, 1),
            (std::vector<float>{1.5, 0.5, -0.5, -1.5, -0.5, 0.5, 1.5}));
  EXPECT_EQ(signedDistances(labels, {1, 7, 1}, 2), (std::vector<float>{3, 1, -1, -3, -1, 1, 3}));
}

TEST(GaussianSmoothing, LeavesLinearFunctionsAloneUpToTheEdge) {
  const GridSize size{12, 7, 9};
  std::vector<float> values;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) values.push_back(static_cast<float>(0.25 * x - 0.5 * y + z));
  const std::vector<float> before = values;
  smoothGaussian(values, size, {1.5, 1.5, 1.5});
  // 4 sigma are 6 samples, fewer than each axis has; rounding of floats below 16
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], before[i], 1e-5);
}

TEST(GaussianSmoothing, AddsTheVarianceToAParabola) {
  const GridSize size{41, 1, 1};
  std::vector<float> values;
  for (int x = 0; x < size[0]; ++x) values.push_back(static_cast<float>((x - 20) * (x - 20)));
  smoothGaussian(values, size, {1.5, 1.5, 1.5});
  // the mean of (x + n)^2 is x^2 + sigma^2; cut off at 4 sigma, 0.1 % of it is missing
  EXPECT_NEAR(values[20], 1.5 * 1.5, 0.01);
  EXPECT_NEAR(values[25], 25 + 1.5 * 1.5, 0.01);
}

}  // namespace
}  // namespace hapticd::solids
