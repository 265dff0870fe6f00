// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/palpation_cue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr double kTick_s = 0.001;

class CueTest : public testing::Test {
 protected:
  CueTest() {
    input_.allowed = true;
    input_.amplitude_n = 0.2;
    input_.frequency_hz = 100;
    input_.contact_force_n = 2;
    input_.normal_in_world = {0, 0, 1};
    input_.velocity_m_per_s_in_world = {0.05, 0, 0};
    input_.period_s = kTick_s;
  }

  Vec3 step() { return cue_.apply(input_, safety_); }
  Vec3 steps(int count) {
    Vec3 force;
    for (int i = 0; i < count; ++i) force = step();
    return force;
  }
  /// Returns the amplitude of the frequency in one second of the cue along x.
  double amplitudeAt(double frequency_hz) {
    std::complex<double> sum;
    constexpr int kTicks = 1000;
    for (int i = 0; i < kTicks; ++i) {
      sum += step().x * std::polar(1.0, -2 * std::numbers::pi * frequency_hz * i * kTick_s);
    }
    return 2 * std::abs(sum) / kTicks;
  }

  PalpationCue cue_;
  PalpationCue::Input input_;
  SafetyParameters safety_;
};

TEST_F(CueTest, VibratesAtItsFrequencyWithItsAmplitude) {
  for (const double frequency : {22.0, 100.0, 240.0}) {
    input_.frequency_hz = frequency;
    steps(100);
    EXPECT_NEAR(amplitudeAt(frequency), 0.2, 0.05 * 0.2);
    EXPECT_LT(amplitudeAt(frequency / 2), 0.01);
  }
}

TEST_F(CueTest, IsAlongTheSurfaceInTheDirectionOfTheMotion) {
  input_.normal_in_world = {0.6, 0, 0.8};
  input_.velocity_m_per_s_in_world = {0.8, 0, 0.6};
  for (int i = 0; i < 100; ++i) {
    const Vec3 force = step();
    EXPECT_NEAR(dot(force, input_.normal_in_world), 0, 1e-12);
  }
  input_.normal_in_world = {0, 0, 1};
  input_.velocity_m_per_s_in_world = {0, 0.1, -0.3};
  steps(1000);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(step().x, 0, 1e-12);
}

TEST_F(CueTest, KeepsItsDirectionWhenTheMotionStops) {
  steps(100);
  input_.velocity_m_per_s_in_world = {0, 0.004, 0};
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(step().y, 0, 1e-12);
  EXPECT_NEAR(amplitudeAt(100), 0.2, 0.01);
}

TEST_F(CueTest, IsLimitedByForceContactAndSlew) {
  input_.amplitude_n = 5;
  steps(100);
  EXPECT_NEAR(amplitudeAt(100), PalpationCue::kMaxForce_n, 0.01);
  input_.contact_force_n = 0.5;
  EXPECT_NEAR(amplitudeAt(100), 0.15, 0.005);
  input_.contact_force_n = 2;
  safety_.max_slew_n_per_s = 200;
  steps(100);
  EXPECT_LE(amplitudeAt(100) * 2 * std::numbers::pi * 100, 0.25 * 200);
  EXPECT_GT(amplitudeAt(100) * 2 * std::numbers::pi * 100, 0.15 * 200);
}

TEST_F(CueTest, TakesAtMostAQuarterOfTheSlewWhateverChanges) {
  for (const double slew : {200.0, 2000.0}) {
    safety_.max_slew_n_per_s = slew;
    Vec3 before = step();
    for (int i = 0; i < 4000; ++i) {
      input_.amplitude_n = i / 300 % 2 == 0 ? 0.3 : 0;
      input_.frequency_hz = i / 700 % 2 == 0 ? 250 : 40;
      const double angle = 0.003 * i;
      input_.velocity_m_per_s_in_world = {0.1 * std::cos(angle), 0.1 * std::sin(angle), 0};
      if (i / 500 % 2 == 0) input_.velocity_m_per_s_in_world = -input_.velocity_m_per_s_in_world;
      const Vec3 force = step();
      ASSERT_LE(norm(force - before), 0.25 * slew * kTick_s) << i;
      before = force;
    }
  }
}

TEST_F(CueTest, IsRampedInAndOut) {
  input_.amplitude_n = 0.3;
  double largest = 0;
  for (int i = 0; i < 10; ++i) largest = std::max(largest, norm(step()));
  EXPECT_LE(largest, 0.15);
  EXPECT_GT(largest, 0.05);
  steps(100);
  input_.amplitude_n = 0;
  for (int i = 0; i < 10; ++i) steps(1);
  double after = 0;
  for (int i = 0; i < 9; ++i) after = std::max(after, norm(step()));
  EXPECT_GT(after, 0.01);
  steps(2);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(step(), Vec3{});
}

TEST_F(CueTest, IsNothingWhereItIsNotAllowed) {
  steps(100);
  input_.allowed = false;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(step(), Vec3{});
}

}  // namespace
}  // namespace hapticd::rt
