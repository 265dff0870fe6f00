// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace hapticd::tools {
namespace {

TEST(LargestStable, FindsAThresholdToItsTolerance) {
  for (const double guess : {50.0, 100.0, 1000.0}) {
    const LargestStable found = largestStable([](double value) { return value <= 123.4; }, guess, 1e6);
    EXPECT_FALSE(found.capped);
    EXPECT_LE(found.value, 123.4);
    EXPECT_GE(found.value, 123.4 / 1.02);
  }
}

TEST(LargestStable, StopsBelowABandOfInstability) {
  const LargestStable found =
      largestStable([](double value) { return value < 150 || value > 200; }, 100, 1e6);
  EXPECT_LE(found.value, 150);
}

TEST(LargestStable, SaysWhenAllIsStableAndWhenNothingIs) {
  EXPECT_TRUE(largestStable([](double) { return true; }, 100, 1000).capped);
  EXPECT_EQ(largestStable([](double) { return false; }, 100, 1000).value, 0);
}

LoopLimit limitOf(const std::string& wall, std::size_t grip, std::size_t device, int delay) {
  return findLimit({wall, allGrips().at(grip), allDevices().at(device), delay});
}

TEST(FindLimit, OfTheReferenceWallIsTheEigenvalueLimit) {
  for (const std::size_t grip : {1U, 2U, 3U}) {
    for (const int delay : {0, 2, 10}) {
      // 2 % of the search, and 1 % of the damping that the judgement of a run leaves
      const LoopLimit limit = limitOf("reference", grip, 0, delay);
      EXPECT_NEAR(limit.ratio(), 0.985, 0.02) << allGrips().at(grip).name << " " << delay;
    }
  }
}

TEST(FindLimit, OfAReleasedDeviceIsTheEigenvalueLimit) {
  EXPECT_NEAR(limitOf("reference", 0, 0, 1).ratio(), 0.985, 0.02);
}

TEST(FindLimit, IsHigherWithCoulombFriction) {
  EXPECT_GT(limitOf("reference", 1, 2, 1).found_n_per_m, 1.1 * limitOf("reference", 1, 0, 1).found_n_per_m);
}

TEST(FindLimit, OfThePapersLawIsTheoryAtTheStiffnessFeltOnItsOuterFlank) {
  const LoopLimit limit = limitOf("nearest_springs", 3, 0, 5);
  EXPECT_NEAR(limit.renderedRatio(), 0.985, 0.03);
  // -dF_N/dh = k (1 - 2 D a_N^2 / (S (h + S)^2)), a_N^2 = N Z^2 / (pi fx fy), at 1 m
  const double a_squared = 100 / (std::numbers::pi * 594.214342 * 591.040537);
  const double h = limit.rest_h_m;
  const double s = std::sqrt(h * h + a_squared);
  EXPECT_NEAR(limit.rendered_by_set, 1 - 2 * 0.04 * a_squared / (s * (h + s) * (h + s)), 0.01);
}

TEST(RunDefaults, ComeToRestWithEveryDeviceOnSaleAtItsOwnLimits) {
  for (const DeviceKind& device : devicesOnSale()) {
    for (const Grip& grip : allGrips()) {
      for (const int delay_ticks : {0, 1, 2, 3, 5, 10}) {
        const DefaultRun result = runDefaults({"surface", grip, device, delay_ticks});
        const std::string name = fmt::format("{} {} {} ms", device.name, grip.name, delay_ticks);
        EXPECT_TRUE(result.run.stable) << name;
        EXPECT_LE(result.run.most_given_j, kMaxGiven_j) << name;
        EXPECT_LE(result.stiffness_kept_n_per_m, device.stiffness_n_per_m) << name;
      }
    }
  }
}

// The velocity lags behind the position, which matters for stiff loops with little delay.
TEST(RunDefaults, ComeToRestWithDevicesOfAnyStiffnessThatNobodyHolds) {
  constexpr double kLimit_n = 4;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  for (int i = 0; i < 100; ++i) {
    const DeviceKind device{.name = "any",
                            .mass_kg = 0.045 * std::pow(5, share(random)),
                            .max_force_n = kLimit_n,
                            .stiffness_n_per_m = 200 * std::pow(25, share(random))};
    const int delay_ticks = static_cast<int>(8 * share(random));
    const DefaultRun result = runDefaults({"surface", allGrips().front(), device, delay_ticks});
    const double stored_at_rest_j = kLimit_n / 2 * kLimit_n / 2 / (2 * result.stiffness_kept_n_per_m);
    EXPECT_TRUE(result.run.stable && result.run.most_given_j <= stored_at_rest_j)
        << device.mass_kg << " kg, " << device.stiffness_n_per_m << " N/m, " << delay_ticks << " ms: gives "
        << result.run.most_given_j << " J";
  }
}

TEST(CoreWall, GivesThePapersForceOfTheClosedFormOnAPlane) {
  CoreWall wall(rt::ForceLaw::nearest_springs, {}, CoreOutput::law);
  wall.set(500, 0);
  const double a_squared = 100 / (std::numbers::pi * 594.214342 * 591.040537);
  for (const double h : {0.005, 0.01, 0.02, 0.03}) {
    wall.approach(h);
    const double s = std::sqrt(h * h + a_squared);
    // the lattice of pixels against the continuum: 0.1 % of the force, as the fact sheet measured
    EXPECT_NEAR(wall.force_n(h, 0), 500 * h * (0.08 / (h + s) - 1), 0.02) << h;
  }
}

TEST(ExplanationOf, IsEmptyWithinTenPercentAndSaysWhatWasFeltElsewhere) {
  LoopLimit limit;
  limit.eigenvalue_n_per_m = 1000;
  limit.found_n_per_m = 1090;
  EXPECT_EQ(explanationOf(limit, {}), "");
  limit.found_n_per_m = 2000;
  EXPECT_TRUE(explanationOf(limit, {}).starts_with("NOT explained"));
  limit.rendered_by_set = 0.5;
  EXPECT_TRUE(explanationOf(limit, {}).starts_with("rendered there: 0.50"));
}

struct KnownLimit {
  int delay_ticks;
  double hand_stiffness_n_per_m;
  double hand_damping_n_s_per_m;
  double limit_n_per_m;
};

/// Published with the fact sheet on haptics, from another program: T = 1 ms, m = 45 g, b = 0.05 N s/m, B = 0.
constexpr KnownLimit kKnownLimits[] = {
    {0, 400, 4, 8229},  {1, 400, 4, 2776},  {2, 400, 4, 1696}, {5, 400, 4, 824},  {10, 400, 4, 496},
    {20, 400, 4, 355},  {0, 400, 8, 16607}, {1, 400, 8, 5639}, {2, 400, 8, 3477}, {5, 400, 8, 1719},
    {10, 400, 8, 1032}, {0, 0, 0, 100},     {1, 0, 0, 33},     {2, 0, 0, 20},     {5, 0, 0, 9}};

TEST(SampledTheory, HasTheLimitsOfTheFactSheet) {
  for (const KnownLimit& known : kKnownLimits) {
    const DeviceAndHand system{.hand_stiffness_n_per_m = known.hand_stiffness_n_per_m,
                               .hand_damping_n_s_per_m = known.hand_damping_n_s_per_m};
    // printed in whole newtons per metre
    EXPECT_NEAR(eigenvalueLimit_n_per_m(system, {.delay_ticks = known.delay_ticks}), known.limit_n_per_m,
                0.51)
        << known.delay_ticks << " ticks, hand " << known.hand_damping_n_s_per_m << " N s/m";
  }
}

TEST(SampledTheory, AgreesWithTheRuleForALightlyDampedDeviceWithinTheSheetsSpread) {
  for (const double mass_kg : {0.045, 0.1}) {
    for (const double damping : {0.05, 0.2, 1.0}) {
      for (int delay = 0; delay <= 5; ++delay) {
        const DeviceAndHand system{.mass_kg = mass_kg, .damping_n_s_per_m = damping};
        const SampledSpring spring{.delay_ticks = delay};
        const double ratio = eigenvalueLimit_n_per_m(system, spring) / ruleLimit_n_per_m(system, spring);
        EXPECT_GE(ratio, 0.9985) << mass_kg << " " << damping << " " << delay;
        EXPECT_LE(ratio, 1.0205) << mass_kg << " " << damping << " " << delay;
      }
    }
  }
}

TEST(SampledTheory, ShowsThatTheRuleIsOptimisticForMuchWallDamping) {
  const DeviceAndHand system;
  const SampledSpring spring{.damping_n_s_per_m = 2, .delay_ticks = 2};
  const double ratio = eigenvalueLimit_n_per_m(system, spring) / ruleLimit_n_per_m(system, spring);
  EXPECT_GE(ratio, 0.885);  // the sheet's 0.89-0.98, printed to 0.01
  EXPECT_LE(ratio, 0.985);
}

TEST(SampledTheory, CountsTheHandsMassAndDampingWithTheDevices) {
  const DeviceAndHand parts{
      .mass_kg = 0.045, .damping_n_s_per_m = 0.05, .hand_damping_n_s_per_m = 3, .hand_mass_kg = 0.2};
  const DeviceAndHand whole{.mass_kg = 0.245, .damping_n_s_per_m = 3.05};
  const SampledSpring spring{.stiffness_n_per_m = 900, .delay_ticks = 3};
  EXPECT_NEAR(spectralRadius(parts, spring), spectralRadius(whole, spring), 1e-9);
}

TEST(SampledTheory, HasTheSpectralRadiusOfTheSampledOscillationOfTheHandAlone) {
  const DeviceAndHand system{.mass_kg = 0.045, .hand_stiffness_n_per_m = 400, .hand_damping_n_s_per_m = 4};
  // no wall: each tick the motion shrinks by the oscillation's decay
  EXPECT_NEAR(spectralRadius(system, {.stiffness_n_per_m = 0}), std::exp(-0.001 * 4.05 / (2 * 0.045)), 1e-9);
}

}  // namespace
}  // namespace hapticd::tools
