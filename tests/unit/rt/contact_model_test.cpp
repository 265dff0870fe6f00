// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "rt/safety/stiffness_limit.h"
#include "rt/tissue/palpation_cue.h"
#include "rt/tissue/tissue_contact.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr Vec3 kLifts{0, 0, 0.3};  // a surface that moves towards the hand, m/s

TEST(VelocityToDamp, IsTheHandsOwnOnASurfaceAtRest) {
  EXPECT_EQ(rt::velocityToDamp({0.1, -0.2, 0.3}, {}), (Vec3{0.1, -0.2, 0.3}));
}

TEST(VelocityToDamp, DoesNotOpposeASurfaceThatLiftsTheHand) {
  EXPECT_EQ(rt::velocityToDamp({0.1, 0, 0.2}, kLifts), (Vec3{0.1, 0, 0}));
  EXPECT_NEAR(rt::velocityToDamp({0.1, 0, 0.5}, kLifts).z, 0.2, 1e-12);
}

TEST(VelocityToDamp, IsUnchangedForAHandThatRestsOrMovesAgainstTheSurface) {
  EXPECT_EQ(rt::velocityToDamp({}, kLifts), Vec3{});
  EXPECT_EQ(rt::velocityToDamp({0, 0, -0.2}, kLifts), (Vec3{0, 0, -0.2}));
}

}  // namespace

}  // namespace hapticd::test

namespace hapticd::rt {
namespace {

/// A few roundings of forces of some newtons.
constexpr double kRounding = 1e-9;

TissueRegion linear() {
  TissueRegion region;
  region.stiffness_n_per_m = 700;
  region.damping_n_s_per_m = 1.5;
  return region;
}

TissueRegion huntCrossley(double exponent) {
  TissueRegion region;
  region.model = ContactModel::hunt_crossley;
  region.stiffness_n_per_m = 600;
  region.exponent = exponent;
  region.damping_per_speed_s_per_m = 0.4;
  return region;
}

TissueRegion layered(double lower_n_per_m) {
  TissueRegion region;
  region.model = ContactModel::layered;
  region.stiffness_n_per_m = 300;
  region.lower_stiffness_n_per_m = lower_n_per_m;
  region.layer_m = 0.005;
  region.damping_n_s_per_m = 0.7;
  return region;
}

std::vector<TissueRegion> allModels() {
  return {linear(), huntCrossley(1), huntCrossley(1.5), huntCrossley(2), layered(600), layered(100)};
}

TEST(ContactModel, LinearIsASpringWithADamper) {
  const ModelContact contact = contactOf(linear(), 0.004);
  EXPECT_NEAR(contact.force_n, 700 * 0.004, kRounding);
  EXPECT_NEAR(contact.energy_j, 700 * 0.004 * 0.004 / 2, kRounding);
  EXPECT_NEAR(contact.tangent_n_per_m, 700, kRounding);
  EXPECT_NEAR(contact.damping_n_s_per_m, 1.5, kRounding);
}

TEST(ContactModel, HuntCrossleyIsThePowerLaw) {
  for (const double n : {1.0, 1.3, 1.5, 2.0}) {
    const double K = 600 * std::pow(0.005, 1 - n);
    for (const double d : {0.0001, 0.003, 0.005, 0.02}) {
      const ModelContact contact = contactOf(huntCrossley(n), d);
      EXPECT_NEAR(contact.force_n, K * std::pow(d, n), kRounding);
      EXPECT_NEAR(contact.energy_j, K * std::pow(d, n + 1) / (n + 1), kRounding);
      EXPECT_NEAR(contact.tangent_n_per_m, n * K * std::pow(d, n - 1), 1000 * kRounding);
      EXPECT_NEAR(contact.damping_n_s_per_m, 0.4 * K * std::pow(d, n), kRounding);
    }
  }
}

TEST(ContactModel, HuntCrossleyHasTheStatedStiffnessAtTheReferenceDepth) {
  for (const double n : {1.0, 1.5, 2.0}) {
    EXPECT_NEAR(contactOf(huntCrossley(n), kReferenceDepth_m).force_n, 600 * kReferenceDepth_m, kRounding);
  }
}

TEST(ContactModel, LayersActOneAfterTheOther) {
  for (const double lower : {600.0, 100.0}) {
    EXPECT_NEAR(contactOf(layered(lower), 0.003).force_n, 300 * 0.003, kRounding);
    EXPECT_NEAR(contactOf(layered(lower), 0.008).force_n, 300 * 0.005 + lower * 0.003, kRounding);
    EXPECT_NEAR(contactOf(layered(lower), 0.008).tangent_n_per_m, lower, kRounding);
  }
}

TEST(ContactModel, TheCornerBetweenLayersIsOneMillimetreWideAndHasNoStep) {
  const TissueRegion region = layered(600);
  EXPECT_NEAR(contactOf(region, 0.0045).tangent_n_per_m, 300, kRounding);
  EXPECT_NEAR(contactOf(region, 0.005).tangent_n_per_m, 450, kRounding);
  EXPECT_NEAR(contactOf(region, 0.0055).tangent_n_per_m, 600, kRounding);
  constexpr double kStep_m = 1e-6;
  for (double d = 0.004; d < 0.006; d += kStep_m) {
    const double change =
        contactOf(region, d + kStep_m).tangent_n_per_m - contactOf(region, d).tangent_n_per_m;
    ASSERT_LE(std::abs(change), 300 * kStep_m / (2 * kHalfLayerCorner_m) + kRounding) << d;
  }
}

// Simpson's rule over intervals so short that its error is below the tolerance.
TEST(ContactModel, EnergyAndTangentBelongToTheForce) {
  for (const TissueRegion& region : allModels()) {
    constexpr double kStep_m = 1e-5;
    for (double d = 0.001; d < 0.012; d += kStep_m) {
      const ModelContact at = contactOf(region, d);
      const ModelContact middle = contactOf(region, d + kStep_m / 2);
      const ModelContact next = contactOf(region, d + kStep_m);
      ASSERT_NEAR(next.energy_j - at.energy_j, kStep_m / 6 * (at.force_n + 4 * middle.force_n + next.force_n),
                  1e-12);
      ASSERT_NEAR(next.force_n - at.force_n,
                  kStep_m / 6 * (at.tangent_n_per_m + 4 * middle.tangent_n_per_m + next.tangent_n_per_m),
                  1e-6);
    }
  }
}

TEST(ContactModel, NothingStartsWithAForce) {
  for (const TissueRegion& region : allModels()) {
    EXPECT_EQ(contactOf(region, 0).force_n, 0);
    EXPECT_EQ(contactOf(region, 0).energy_j, 0);
    EXPECT_TRUE(std::isfinite(contactOf(region, 0).tangent_n_per_m));
  }
}

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
