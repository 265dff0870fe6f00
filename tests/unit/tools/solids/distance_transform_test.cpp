// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/distance_transform.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace hapticd::solids {
namespace {

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
