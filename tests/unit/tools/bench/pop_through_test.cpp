// SPDX-License-Identifier: Apache-2.0
// Judgements of synthetic force curves; from tick to tick an ideal spring's force rises by 0.05 N.

#include "tools/hapticbench/engine/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr int kTicks = 451;
constexpr double kStep_n = 0.05;  // 0.1 mm at 500 N/m

/// The curve that `force` gives for an ideal force from 0 to 22.5 N.
PopThrough judge(const std::function<double(double)>& force) {
  std::vector<double> ideal;
  std::vector<double> outward;
  for (int i = 0; i < kTicks; ++i) {
    ideal.push_back(i * kStep_n);
    outward.push_back(force(ideal.back()));
  }
  return judgePush(outward, ideal);
}

TEST(PopThrough, DoesNotHappenToAnIdealSpring) {
  const PopThrough push = judge([](double ideal) { return ideal; });
  EXPECT_FALSE(push.popped);
  EXPECT_FALSE(push.dipped);
  EXPECT_DOUBLE_EQ(push.largest_n, 22.5);
  EXPECT_EQ(push.largest_tick, 450U);
  EXPECT_FALSE(push.under(100));
}

TEST(PopThrough, HappensWhereTheForceFallsBelowHalfOfItsLargest) {
  // rises to 8 N, then falls as fast: half of it is lost 4 N of depth later
  const PopThrough push = judge([](double ideal) { return ideal < 8 ? ideal : std::max(16 - ideal, 0.1); });
  EXPECT_TRUE(push.popped);
  EXPECT_NEAR(push.largest_n, 8, kStep_n / 2);
  EXPECT_NEAR(static_cast<double>(push.largest_tick), 160, 1);
  EXPECT_TRUE(push.under(10));
  EXPECT_FALSE(push.under(3));
}

TEST(PopThrough, DoesNotHappenWhereMoreThanHalfOfTheForceStays) {
  EXPECT_FALSE(judge([](double ideal) { return ideal < 8 ? ideal : 4.1; }).popped);
  EXPECT_TRUE(judge([](double ideal) { return ideal < 8 ? ideal : 3.9; }).popped);
}

TEST(PopThrough, IsSeenWhereALawNeverHeldAnything) {
  const PopThrough push = judge([](double) { return 0.0; });
  EXPECT_TRUE(push.popped);
  EXPECT_EQ(push.largest_n, 0);
  EXPECT_TRUE(push.under(3));
}

TEST(PopThrough, IsSeenWhereTheLawPullsInward) {
  EXPECT_TRUE(judge([](double ideal) { return -ideal; }).popped);
  EXPECT_TRUE(judge([](double ideal) { return ideal < 3 ? 0.2 : -0.1; }).popped);
}

TEST(PopThrough, IsNoneInTheShakingOfAForceNearZero) {
  const PopThrough push =
      judge([](double ideal) { return ideal < 0.45 ? 0.2 * std::sin(100 * ideal) : ideal; });
  EXPECT_FALSE(push.popped);
  EXPECT_FALSE(push.dipped);
}

TEST(PopThrough, IsADipWhereTheForceComesBackAndExceedsWhatItWas) {
  const PopThrough push = judge([](double ideal) { return ideal > 8 && ideal < 9 ? 0.0 : ideal; });
  EXPECT_FALSE(push.popped);
  EXPECT_TRUE(push.dipped);
  EXPECT_DOUBLE_EQ(push.largest_n, 22.5);
}

TEST(PopThrough, IsThatBeforeTheLossThatLasts) {
  // a dip at 4 N, the loss at 8 N; the force on leaving at the far side does not count
  const PopThrough push = judge([](double ideal) {
    if (ideal > 4 && ideal < 5) return 1.0;
    return ideal < 8.01 ? ideal : 3.0;
  });
  EXPECT_TRUE(push.popped);
  EXPECT_TRUE(push.dipped);
  EXPECT_NEAR(push.largest_n, 8, kStep_n / 2);
}

// The closed form, against values of a brute-force computation.
TEST(PopThroughForceOnPlane, MatchesTheTable) {
  const auto pop_n = [](double depth_m) { return popThroughForceOnPlane_n({}, {}, depth_m); };
  EXPECT_NEAR(pop_n(0.8), 12.82, 0.006);
  EXPECT_NEAR(pop_n(1.0), 11.81, 0.006);
  EXPECT_NEAR(pop_n(2.0), 7.92, 0.006);
  EXPECT_NEAR(pop_n(3.5), 4.17, 0.006);
}

}  // namespace
}  // namespace hapticd::tools
