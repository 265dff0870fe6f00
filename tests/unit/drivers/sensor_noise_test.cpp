// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/noise_pattern.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

// Checks the components of the noise against their definitions: variance, and correlation over the window,
// over time and over disparity. Tolerances: five standard errors of a mean over independent patches (the
// seeds are fixed).
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

using Image = std::vector<std::uint16_t>;

constexpr float kFlat = 700.3F;
constexpr int kFrames = 100;

// Noise that is independent in each frame, so that every frame adds its own independent patches.
constexpr double kSigmaRaw = 0.5;
constexpr double kIndependentPatches = double{kFrames} * SensorNoise::kFirstDeadColumn * kKinectHeight /
                                       (SensorNoise::kCorrelationPixels * SensorNoise::kCorrelationPixels);
// Five standard errors: one false alarm in a million, and the seed is fixed.
constexpr double kSigmas = 5;

Image sensorImage(const SensorNoise& noise, std::uint64_t frame, const std::vector<float>& exact) {
  Image raw(kKinectPixels);
  noise.applySensor(frame, exact, raw.data());
  return raw;
}

SensorNoise fastNoise() {
  return SensorNoise(7, {.pattern = {.fast_raw = kSigmaRaw}});
}

std::size_t at(int column, int row) {
  return static_cast<std::size_t>(row * kKinectWidth + column);
}

/// Sums over pairs of measured pixels of one image, `lag` columns apart.
struct Moments {
  double count = 0, sum = 0, squares = 0, products = 0;
  void add(const Image& raw, int lag) {
    for (int row = 0; row < kKinectHeight; row += 8) {
      for (int column = 0; column + lag < SensorNoise::kFirstDeadColumn; column += 8) {
        const auto a = raw[at(column, row)];
        const auto b = raw[at(column + lag, row)];
        if (a == kKinectNoMeasurement || b == kKinectNoMeasurement) continue;
        const double da = a - double{kFlat};
        const double db = b - double{kFlat};
        count += 1;
        sum += da;
        squares += da * da;
        products += da * db;
      }
    }
  }
  double mean() const { return sum / count; }
  double variance() const { return squares / count - mean() * mean(); }
  double correlation() const { return (products / count - mean() * mean()) / variance(); }
};

Moments momentsAtLag(int lag) {
  const SensorNoise noise = fastNoise();
  const std::vector<float> exact(kKinectPixels, kFlat);
  Moments moments;
  for (int frame = 0; frame < kFrames; ++frame)
    moments.add(sensorImage(noise, static_cast<std::uint64_t>(frame), exact), lag);
  return moments;
}

TEST(SensorNoise, HasTheMeanOfTheSurfaceAndTheVarianceOfNoiseAndRounding) {
  const Moments moments = momentsAtLag(0);
  // Rounding adds 1/12; its dependence on the phase within a unit is damped by exp(-2 pi^2 sigma^2) = 0.0072.
  const double phase = 0.0072;
  const double expected = kSigmaRaw * kSigmaRaw + 1.0 / 12;
  EXPECT_NEAR(moments.mean(), 0, kSigmas * kSigmaRaw / std::sqrt(kIndependentPatches) + phase);
  EXPECT_NEAR(
      moments.variance(), expected,
      kSigmas * expected * std::sqrt(2 / kIndependentPatches) + (4 * kSigmaRaw * kSigmaRaw + 0.1) * phase);
}

TEST(SensorNoise, MakesTheStatedShareOfPixelsFlicker) {
  const SensorNoise noise(7);
  const std::vector<float> exact(kKinectPixels, kFlat);
  constexpr int kFlickerFrames = 60;
  std::vector<int> missing(kKinectPixels);
  for (std::uint64_t frame = 0; frame < kFlickerFrames; ++frame) {
    const Image raw = sensorImage(noise, frame, exact);
    for (std::size_t pixel = 0; pixel < raw.size(); ++pixel)
      missing[pixel] += raw[pixel] == kKinectNoMeasurement;
  }
  double flickering = 0;
  double always_missing = 0;
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 0; column < SensorNoise::kFirstDeadColumn; ++column) {
      flickering += missing[at(column, row)] > 0 && missing[at(column, row)] < kFlickerFrames;
      always_missing += missing[at(column, row)] == kFlickerFrames;
    }
  }
  const double pixels = double{SensorNoise::kFirstDeadColumn} * kKinectHeight;
  const double patches = pixels / (SensorNoise::kCorrelationPixels * SensorNoise::kCorrelationPixels);
  const double share = noise.parameters().flicker_share;
  EXPECT_NEAR(flickering / pixels, share, kSigmas * std::sqrt(share * (1 - share) / patches));
  EXPECT_EQ(always_missing, 0);
}

TEST(SensorNoise, MakesTheRimOfAStepFlickerAndNotItsSurroundings) {
  const SensorNoise noise(7, {.shadow_side = ShadowSide::none});
  std::vector<float> exact(kKinectPixels, kFlat);
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 300; column < kKinectWidth; ++column) exact[at(column, row)] = kFlat + 50;
  }
  int rim = 0;
  int beside = 0;
  for (std::uint64_t frame = 0; frame < 40; ++frame) {
    const Image raw = sensorImage(noise, frame, exact);
    for (int row = 0; row < kKinectHeight; ++row) {
      rim += raw[at(299, row)] == kKinectNoMeasurement;
      rim += raw[at(300, row)] == kKinectNoMeasurement;
      beside += raw[at(290, row)] == kKinectNoMeasurement;
      beside += raw[at(310, row)] == kKinectNoMeasurement;
    }
  }
  // Half of the time against half of a tenth; 40 frames x 480 / 9 independent patches.
  const double observations = 40.0 * 2 * kKinectHeight;
  const double tolerance =
      kSigmas * std::sqrt(0.25 / (40.0 * kKinectHeight / SensorNoise::kCorrelationPixels));
  EXPECT_NEAR(rim / observations, 0.5, tolerance);
  EXPECT_LT(beside / observations, 0.5 * noise.parameters().flicker_share + 4 * tolerance);
}

TEST(SensorNoise, MakesTheStatedShareOfTheMeasuredRimFlyingPixels) {
  constexpr double kFlying = 0.2;
  constexpr float kStep = 100;
  const SensorNoise noise(7, {.flying_share = kFlying, .shadow_side = ShadowSide::none});
  std::vector<float> exact(kKinectPixels, kFlat);
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 300; column < kKinectWidth; ++column) exact[at(column, row)] = kFlat + kStep;
  }
  double measured = 0;
  double flying = 0;
  for (std::uint64_t frame = 0; frame < 40; ++frame) {
    const Image raw = sensorImage(noise, frame, exact);
    for (int row = 0; row < kKinectHeight; ++row) {
      for (const int column : {299, 300}) {
        const double value = raw[at(column, row)];
        if (value == kKinectNoMeasurement) continue;
        measured += 1;
        flying += value > double{kFlat} + 3 && value < double{kFlat + kStep} - 3;
        EXPECT_GT(value, double{kFlat} - 3);
        EXPECT_LT(value, double{kFlat + kStep} + 3);
      }
    }
  }
  // Six of a hundred raw units are within 3 of a side and do not count; pixels are independent.
  const double expected = kFlying * 0.94;
  EXPECT_NEAR(flying / measured, expected, kSigmas * std::sqrt(expected * (1 - expected) / measured));
}

TEST(SensorNoise, LeavesTheLastColumnsWithoutMeasurement) {
  const SensorNoise noise(7);
  const Image raw = sensorImage(noise, 3, std::vector<float>(kKinectPixels, kFlat));
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 632; column < 640; ++column) ASSERT_EQ(raw[at(column, row)], 2047);
  }
}

TEST(SensorNoise, StaysWithin11BitsAtBothEndsOfTheRange) {
  const SensorNoise noise(7);
  for (const float end : {0.0F, 2046.0F}) {
    Image raw = sensorImage(noise, 3, std::vector<float>(kKinectPixels, end));
    EXPECT_LE(*std::ranges::max_element(raw), 2047);
    const auto measured =
        std::ranges::count_if(raw, [end](auto value) { return std::abs(value - end) < 5 && value < 2047; });
    EXPECT_GT(measured, 100'000);
  }
}

TEST(SensorNoise, DitherRoundsToOneOfTwoNeighboursAndIsUnbiased) {
  const SensorNoise noise(7);
  const std::vector<float> exact(kKinectPixels, kFlat);
  Image raw(kKinectPixels);
  double upper = 0;
  constexpr int kDitherFrames = 20;
  for (std::uint64_t frame = 0; frame < kDitherFrames; ++frame) {
    noise.dither(frame, exact, raw.data());
    for (const auto value : raw) {
      ASSERT_TRUE(value == 700 || value == 701);
      upper += value == 701;
    }
  }
  const double observations = double{kDitherFrames} * kKinectPixels;
  const double share = double{kFlat} - 700;
  EXPECT_NEAR(upper / observations, share, kSigmas * std::sqrt(share * (1 - share) / observations));
}

}  // namespace
}  // namespace hapticd::drivers
