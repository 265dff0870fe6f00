// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/measures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::tools {
namespace {

TEST(JustNoticeableDifference, IsSevenPercentOfLargeForces) {
  EXPECT_DOUBLE_EQ(justNoticeableDifference_n(10), 0.7);
  EXPECT_DOUBLE_EQ(justNoticeableDifference_n(2.5), 0.175);
}

TEST(JustNoticeableDifference, IsATenthOfANewtonForSmallForces) {
  EXPECT_DOUBLE_EQ(justNoticeableDifference_n(0), 0.1);
  EXPECT_DOUBLE_EQ(justNoticeableDifference_n(1.4), 0.1);
  EXPECT_GT(justNoticeableDifference_n(1.5), 0.1);
}

TEST(Spread, IsTheRootMeanSquareAndTheLargest) {
  Spread spread;
  EXPECT_EQ(spread.rms(), 0);
  spread.add(3);
  spread.add(4);
  EXPECT_DOUBLE_EQ(spread.rms(), std::sqrt(12.5));
  EXPECT_EQ(spread.max(), 4);
  EXPECT_EQ(spread.count(), 2U);
}

TEST(Spread, OfTwoPartsIsThatOfTheWhole) {
  Spread first;
  first.add(1);
  Spread second;
  second.add(2);
  second.add(7);
  first.add(second);
  EXPECT_DOUBLE_EQ(first.rms(), std::sqrt(18.0));
  EXPECT_EQ(first.max(), 7);
}

TEST(ForceErrors, AreSizeShareAndMultiplesOfWhatIsNoticed) {
  ForceErrors errors;
  errors.add({0, 0, 5.5}, {0, 0, 5});
  // rounding of 5.5 - 5 and of a quotient
  EXPECT_DOUBLE_EQ(errors.error_n.rms(), 0.5);
  EXPECT_DOUBLE_EQ(errors.error_percent.rms(), 10);
  EXPECT_NEAR(errors.error_jnd.rms(), 0.5 / 0.35, 1e-12);
  EXPECT_EQ(errors.direction_deg.max(), 0);
}

TEST(ForceErrors, MeasureTheAngleBetweenForceAndTruth) {
  const auto angle_deg = [](const rt::Vec3& force) {
    ForceErrors errors;
    errors.add(force, {0, 0, 2});
    return errors.direction_deg.max();
  };
  EXPECT_NEAR(angle_deg({1, 0, 0}), 90, 1e-9);
  EXPECT_NEAR(angle_deg({0, 0, -3}), 180, 1e-9);
  EXPECT_NEAR(angle_deg({0, 5, 5}), 45, 1e-9);
  EXPECT_NEAR(angle_deg({1e-6, 0, 1}), 1e-6 * 57.29577951308232, 1e-12);
}

TEST(ForceErrors, CountNoDirectionWhereThereIsHardlyAForce) {
  ForceErrors errors;
  errors.add({0, 0, 0}, {0, 0, 5});
  errors.add({0.04, 0, 0}, {0, 0, 5});
  errors.add({0, 0, 5}, {0, 0, 0});
  EXPECT_EQ(errors.direction_deg.count(), 0U);
  EXPECT_EQ(errors.error_n.count(), 3U);
  EXPECT_EQ(errors.error_percent.count(), 2U);  // no share of zero
  EXPECT_DOUBLE_EQ(errors.error_jnd.max(), 50);
}

TEST(RightForce, IsWithin30DegreesOfTheNormal) {
  const auto turned_by = [](double degrees) {
    const double angle = degrees * 3.14159265358979 / 180;
    return rt::Vec3{4 * std::sin(angle), 0, 4 * std::cos(angle)};
  };
  EXPECT_TRUE(isRightForce(turned_by(0), {0, 0, 4}));
  EXPECT_TRUE(isRightForce(turned_by(29), {0, 0, 4}));
  EXPECT_FALSE(isRightForce(turned_by(31), {0, 0, 4}));
  EXPECT_FALSE(isRightForce(turned_by(90), {0, 0, 4}));
}

TEST(RightForce, IsAsLargeAsTheSpringToHalfANewtonOrOneJnd) {
  EXPECT_TRUE(isRightForce({0, 0, 4.49}, {0, 0, 4}));
  EXPECT_FALSE(isRightForce({0, 0, 3.49}, {0, 0, 4}));
  EXPECT_TRUE(isRightForce({0, 0, 21.3}, {0, 0, 20}));  // 7 %
  EXPECT_FALSE(isRightForce({0, 0, 21.5}, {0, 0, 20}));
}

TEST(RightForce, HasNoDirectionWhereNobodyNoticesIt) {
  EXPECT_TRUE(isRightForce({0.09, 0, 0}, {0, 0, 0.3}));
  EXPECT_FALSE(isRightForce({0.11, 0, 0}, {0, 0, 0.3}));
  EXPECT_FALSE(isRightForce({}, {0, 0, 0.6}));
}

}  // namespace
}  // namespace hapticd::tools
