// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/low_pass.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr double kPeriod_s = 0.001;

/// Gain of y += a (x - y) at the frequency f: a / |1 - (1 - a) e^(-i 2 pi f T)|.
double theoreticalGain(double cutoff_hz, double frequency_hz) {
  const double a = 1 - std::exp(-2 * std::numbers::pi * cutoff_hz * kPeriod_s);
  const double angle = 2 * std::numbers::pi * frequency_hz * kPeriod_s;
  return a / std::hypot(1 - (1 - a) * std::cos(angle), (1 - a) * std::sin(angle));
}

TEST(LowPass, HasTheGainOfItsTransferFunction) {
  for (const double frequency_hz : {5.0, 50.0, 200.0}) {
    rt::LowPass filter;
    double largest = 0;
    for (int tick = 0; tick < 4000; ++tick) {
      const double x = std::sin(2 * std::numbers::pi * frequency_hz * tick * kPeriod_s + 0.3);
      const Vec3 y = filter.apply({0, x, 0}, 50, kPeriod_s);
      if (tick > 2000) largest = std::max(largest, std::abs(y.y));
    }
    // the largest of 2000 samples of a sine is within 2e-3 of its amplitude unless f divides the rate
    EXPECT_NEAR(largest, theoreticalGain(50, frequency_hz), 0.06 * theoreticalGain(50, frequency_hz));
  }
}

TEST(LowPass, PassesItsInputWhileOffAndStartsFromThereWhenSwitchedOn) {
  rt::LowPass filter;
  EXPECT_EQ(filter.apply({1, 2, 3}, 0, kPeriod_s), (Vec3{1, 2, 3}));
  EXPECT_EQ(filter.apply({1, 2, 3}, 10, kPeriod_s), (Vec3{1, 2, 3}));
}

TEST(LowPass, ReachesItsInputExactly) {
  for (const Vec3& input : {Vec3{}, Vec3{0, 2, 0}}) {
    rt::LowPass filter;
    filter.apply({1, 2, 3}, 0, kPeriod_s);
    Vec3 before{1, 2, 3};
    Vec3 output = filter.apply(input, 80, kPeriod_s);
    for (int tick = 0; tick < 1000 && !(output == input); ++tick) {
      before = output;
      output = filter.apply(input, 80, kPeriod_s);
    }
    EXPECT_EQ(output, input);
    // One step covers 40 % of the distance, so at most 1 nN / 0.6 is left before the last one.
    EXPECT_LT(norm(before - input), 2e-9) << "no perceptible difference is skipped";
    EXPECT_GE(norm(before - input), 1e-9);
  }
}

}  // namespace
}  // namespace hapticd::test
