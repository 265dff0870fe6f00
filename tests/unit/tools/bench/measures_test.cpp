// SPDX-License-Identifier: Apache-2.0
// Errors of forces; judgements of synthetic force curves, of which an ideal spring's force rises by 0.05 N
// from tick to tick; the spectrum of sines and of noise that are known.

#include "tools/hapticbench/engine/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

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

constexpr double kRate_hz = 1000;
constexpr std::size_t kValues = 8 * Spectrum::kSegment;

std::vector<double> sine(double amplitude, double frequency_hz) {
  std::vector<double> values(kValues);
  for (std::size_t i = 0; i < kValues; ++i)
    values[i] = amplitude * std::sin(2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / kRate_hz);
  return values;
}

TEST(Spectrum, FindsTheAmplitudeAndTheFrequencyOfASine) {
  const Spectrum spectrum(sine(0.02, 125), kRate_hz);  // bin 128
  const Spectrum::Line line = spectrum.largestLine(60, 500);
  EXPECT_NEAR(line.amplitude, 0.02, 1e-9);
  EXPECT_DOUBLE_EQ(line.frequency_hz, 125);
  EXPECT_NEAR(spectrum.rms(60, 500), 0.02 / std::numbers::sqrt2, 1e-9);
}

TEST(Spectrum, ShowsASineBetweenTwoBinsUpTo15PercentLower) {
  const Spectrum spectrum(sine(1, 125 + 500.0 / Spectrum::kSegment), kRate_hz);
  EXPECT_NEAR(spectrum.largestLine(60, 500).amplitude, 8 / (3 * std::numbers::pi), 1e-3);
  EXPECT_NEAR(spectrum.rms(60, 500), 1 / std::numbers::sqrt2, 1e-3);
}

TEST(Spectrum, LeavesOutWhatIsBelowTheBand) {
  std::vector<double> values = sine(1, 5.3);
  for (double& value : values) value += 4;
  // the Hann window's side lobes fall by 18 dB per octave: below 1e-5 of the sine 50 bins away
  EXPECT_LT(Spectrum(values, kRate_hz).rms(60, 500), 1e-4);
}

TEST(Spectrum, FindsASineInNoiseAndThePowerOfBoth) {
  constexpr double kSine = 0.02;
  constexpr double kNoise = 0.05;
  std::vector<double> values = sine(kSine, 250);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, kNoise);
  for (double& value : values) value += noise(random);
  const Spectrum spectrum(values, kRate_hz);
  const Spectrum::Line line = spectrum.largestLine(60, 500);
  EXPECT_DOUBLE_EQ(line.frequency_hz, 250);
  // Noise of 0.05 has 1.5 * 2 / 1024 of its power in a bin of the Hann window: 2.7 mN beside the line's 14.1,
  // in quadrature, and averaged over 15 segments, half of which are independent.
  EXPECT_NEAR(line.amplitude, kSine, 3 * 0.0027 * std::numbers::sqrt2 / std::sqrt(7.5));
  // 440 of 500 Hz of the noise; 8192 values know their variance to 1.6 %
  const double expected = std::sqrt(kNoise * kNoise * 440 / 500 + kSine * kSine / 2);
  EXPECT_NEAR(spectrum.rms(60, 500), expected, 3 * 0.008 * expected);
}

TEST(Spectrum, OfAVectorIsTheSumOfItsComponents) {
  Spectrum sum(sine(0.03, 125), kRate_hz);
  sum.add(Spectrum(sine(0.04, 125), kRate_hz));
  EXPECT_NEAR(sum.largestLine(60, 500).amplitude, 0.05, 1e-9);
}

}  // namespace
}  // namespace hapticd::tools
