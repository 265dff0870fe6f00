// SPDX-License-Identifier: Apache-2.0
#include "rt/fixtures/half_spaces.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/unit/rt/fixture_rig.h"

namespace hapticd::test {
namespace {

using rt::HalfSpace;
using rt::Vec3;

/// Solves n_i x = b_i for up to three planes as the point of all of them that is nearest to `from`, by
/// Cramer's rule on the Gram matrix. Returns false if they are nearly dependent.
bool onPlanes(const std::vector<HalfSpace>& planes, const Vec3& from, Vec3& place) {
  const std::size_t count = planes.size();
  double gram[3][4]{};
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) gram[i][j] = dot(planes[i].normal, planes[j].normal);
    gram[i][3] = planes[i].offset_m - dot(planes[i].normal, from);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (std::abs(gram[i][i]) < 1e-6) return false;
    for (std::size_t row = i + 1; row < count; ++row) {
      const double factor = gram[row][i] / gram[i][i];
      for (std::size_t column = 0; column < 4; ++column) gram[row][column] -= factor * gram[i][column];
    }
  }
  double multiplier[3]{};
  for (std::size_t i = count; i-- > 0;) {
    double sum = gram[i][3];
    for (std::size_t j = i + 1; j < count; ++j) sum -= gram[i][j] * multiplier[j];
    multiplier[i] = sum / gram[i][i];
  }
  place = from;
  for (std::size_t i = 0; i < count; ++i) place += multiplier[i] * planes[i].normal;
  return true;
}

/// The nearest allowed point by trying all sets of up to three active constraints.
double bruteForceDistance(const std::vector<HalfSpace>& all, const Vec3& from) {
  double best = std::numeric_limits<double>::infinity();
  const auto compare = [&](const std::vector<HalfSpace>& active) {
    Vec3 place;
    if (!onPlanes(active, from, place)) return;
    for (const HalfSpace& half_space : all) {
      if (half_space.room_m(place) < -1e-9) return;
    }
    best = std::min(best, norm(place - from));
  };
  compare({});
  for (std::size_t a = 0; a < all.size(); ++a) {
    compare({all[a]});
    for (std::size_t b = a + 1; b < all.size(); ++b) {
      compare({all[a], all[b]});
      for (std::size_t c = b + 1; c < all.size(); ++c) compare({all[a], all[b], all[c]});
    }
  }
  return best;
}

TEST(HalfSpaces, TheProjectionIsTheNearestAllowedPoint) {
  RandomShapes random(7);
  int feasible = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<HalfSpace> all;
    const int count = 1 + i % 7;
    for (int j = 0; j < count; ++j) all.push_back({random.direction(), random.between(-0.05, 0.02)});
    const Vec3 from = random.place(0.1);
    const double expected = bruteForceDistance(all, from);
    Vec3 place;
    std::vector<double> multipliers(all.size());
    const bool found = rt::projectOnto(all, from, place, multipliers);
    ASSERT_EQ(found, std::isfinite(expected)) << i;
    if (!found) continue;
    ++feasible;
    ASSERT_NEAR(norm(place - from), expected, 1e-8) << i;
    Vec3 composed = from;
    for (std::size_t j = 0; j < all.size(); ++j) {
      ASSERT_GE(multipliers[j], 0);
      ASSERT_GE(all[j].room_m(place), -1e-9);
      composed += multipliers[j] * all[j].normal;
    }
    ASSERT_LT(norm(composed - place), 1e-9) << "the multipliers compose the displacement";
  }
  EXPECT_GT(feasible, 2000);
}

TEST(HalfSpaces, ParallelAndRepeatedOnesAreNoProblem) {
  const std::array<HalfSpace, 4> same{
      {{{0, 0, 1}, 0.01}, {{0, 0, 1}, 0.01}, {{0, 0, 1}, 0.02}, {{0, 0, -1}, -0.5}}};
  Vec3 place;
  std::array<double, 4> multipliers{};
  ASSERT_TRUE(rt::projectOnto(same, {1, 2, -1}, place, multipliers));
  EXPECT_NEAR(place.z, 0.02, 1e-12);
  EXPECT_EQ(place.x, 1);
}

TEST(HalfSpaces, WithoutAnAllowedPointEachMultiplierIsItsOwnDepth) {
  const std::array<HalfSpace, 2> apart{{{{0, 0, 1}, 0.01}, {{0, 0, -1}, 0.02}}};
  Vec3 place;
  std::array<double, 2> multipliers{};
  ASSERT_FALSE(rt::projectOnto(apart, {0, 0, 0}, place, multipliers));
  EXPECT_EQ(place, Vec3{});
  EXPECT_NEAR(multipliers[0], 0.01, 1e-15);
  EXPECT_NEAR(multipliers[1], 0.02, 1e-15);
}

}  // namespace
}  // namespace hapticd::test
