// SPDX-License-Identifier: Apache-2.0
// The spectrum of sines and of noise that are known.

#include "tools/hapticbench/engine/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace hapticd::tools {
namespace {

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
