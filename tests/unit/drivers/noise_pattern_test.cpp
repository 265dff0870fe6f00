// SPDX-License-Identifier: Apache-2.0
// Checks the components of the noise against their definitions: variance, and correlation over the window,
// over time and over disparity. Tolerances: five standard errors of a mean over independent patches (the
// seeds are fixed).

#include "drivers/camera/synthetic/noise_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {
namespace {

using Field = std::vector<float>;

constexpr double kStandardErrors = 5;
constexpr int kSeeds = 8;
constexpr double kPatches = kSeeds * double{kKinectPixels} / (NoisePattern::kWindow * NoisePattern::kWindow);
// Of a correlation coefficient, or of a variance relative to itself, from kPatches independent patches.
const double kCorrelationTolerance = kStandardErrors / std::sqrt(kPatches);
const double kVarianceTolerance = kStandardErrors * std::sqrt(2 / kPatches);

/// Disparities that cover all phases within a raw unit, 0.05 per pixel and row.
Field ramp(float shift_raw) {
  Field exact;
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 0; column < kKinectWidth; ++column)
      exact.push_back(600.0F + 0.05F * static_cast<float>(column + row) + shift_raw);
  }
  return exact;
}

Field noiseOf(const NoisePattern& pattern, std::uint64_t frame, const Field& exact) {
  Field noise(kKinectPixels);
  pattern.render(frame, exact, noise);
  return noise;
}

double meanProduct(const Field& a, const Field& b, std::size_t lag = 0) {
  double sum = 0;
  for (std::size_t i = 0; i + lag < a.size(); ++i) sum += double{a[i]} * double{b[i + lag]};
  return sum / static_cast<double>(a.size() - lag);
}

/// Returns the mean over seeds of the product of the pixels of two images, the second shifted by `lag`
/// pixels.
double covariance(const NoisePatternParameters& parameters, std::uint64_t frame, float shift_raw,
                  std::size_t lag = 0) {
  double sum = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const NoisePattern pattern(seed, parameters);
    sum += meanProduct(noiseOf(pattern, 100, ramp(0)), noiseOf(pattern, 100 + frame, ramp(shift_raw)), lag);
  }
  return sum / kSeeds;
}

TEST(NoisePattern, HasTheVarianceOfEachOfItsParts) {
  const double expected = 0.25;
  for (const NoisePatternParameters& part : {NoisePatternParameters{.static_raw = 0.5},
                                             NoisePatternParameters{.drift_raw = 0.5, .drift_frames = 10},
                                             NoisePatternParameters{.fast_raw = 0.5}}) {
    EXPECT_NEAR(covariance(part, 0, 0), expected, expected * kVarianceTolerance);
    EXPECT_DOUBLE_EQ(part.variance(), expected);
  }
}

TEST(NoisePattern, IsCorrelatedOverTheMatchingWindowAndNotBeyond) {
  const NoisePatternParameters fast{.fast_raw = 1};
  EXPECT_NEAR(covariance(fast, 0, 0, 3), 1 - 3.0 / 9, kCorrelationTolerance);
  EXPECT_NEAR(covariance(fast, 0, 0, 6), 1 - 6.0 / 9, kCorrelationTolerance);
  EXPECT_NEAR(covariance(fast, 0, 0, 12), 0, kCorrelationTolerance);
  EXPECT_NEAR(covariance(fast, 0, 0, 3 * std::size_t{kKinectWidth}), 1 - 3.0 / 9, kCorrelationTolerance);
}

TEST(NoisePattern, DistortionExtendsOverItsLargerWindowAndStaysWhenTheSceneMoves) {
  const NoisePatternParameters coarse{.coarse_raw = 1};
  const double ratio = double{NoisePattern::kCoarseWindow} / NoisePattern::kWindow;
  const double tolerance = ratio * kCorrelationTolerance;  // fewer patches by this ratio along each axis
  EXPECT_NEAR(covariance(coarse, 0, 0, 11), 1 - 11.0 / 33, tolerance);
  EXPECT_NEAR(covariance(coarse, 7, 80), 1, tolerance * std::sqrt(2));
}

TEST(NoisePattern, StaticPartKeepsHalfOfItsCorrelationAfterOneRawUnitAndAFifthAfterSixty) {
  const NoisePatternParameters fixed{.static_raw = 1};
  EXPECT_NEAR(covariance(fixed, 0, 1), 0.5, kCorrelationTolerance);
  EXPECT_NEAR(covariance(fixed, 0, -1), 0.5, kCorrelationTolerance);
  EXPECT_NEAR(covariance(fixed, 0, 60), 0.2, kCorrelationTolerance);
}

TEST(NoisePattern, StaticPartFollowsItsStatedCorrelationInBetween) {
  const NoisePatternParameters fixed{.static_raw = 1};
  EXPECT_DOUBLE_EQ(NoisePattern::staticCorrelation(fixed, 0), 1);
  for (const float change : {0.2F, 0.4F, 0.7F, 10.0F, 35.0F}) {
    EXPECT_NEAR(covariance(fixed, 0, change), NoisePattern::staticCorrelation(fixed, double{change}),
                kCorrelationTolerance)
        << change;
  }
}

TEST(NoisePattern, DriftLosesItsCorrelationExponentially) {
  const NoisePatternParameters drift{.drift_raw = 1, .drift_frames = 10};
  for (const std::uint64_t frames : {1U, 5U, 10U, 20U, 60U}) {
    EXPECT_NEAR(covariance(drift, frames, 0), std::exp(-static_cast<double>(frames) / 10),
                kCorrelationTolerance)
        << frames;
  }
}

TEST(NoisePattern, PartsAndSeedsAreUncorrelated) {
  const NoisePattern first(1, {.static_raw = 1, .drift_raw = 1, .drift_frames = 10});
  const NoisePattern second(2, {.static_raw = 1, .drift_raw = 1, .drift_frames = 10});
  // of one seed only, so fewer patches; the variance is two
  const double tolerance = 2 * kCorrelationTolerance * std::sqrt(double{kSeeds});
  EXPECT_NEAR(meanProduct(noiseOf(first, 5, ramp(0)), noiseOf(second, 5, ramp(0))), 0, tolerance);
}

}  // namespace
}  // namespace hapticd::drivers
