// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/contact_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tools/hapticbench/stability/energy_ledger.h"
#include "tools/hapticbench/stability/sampled_theory.h"
#include "tools/hapticbench/stability/stability_report.h"
#include "tools/hapticbench/stability/stability_study.h"

namespace hapticd::tools {
namespace {

TEST(EnergyLedger, OfAPassiveSpringIsZeroOverWholeCycles) {
  const double stiffness_n_per_m = 700;
  EnergyLedger ledger;
  const auto at = [](int step) {
    return 0.001 + 0.004 * std::sin(2 * std::numbers::pi * (step - 0.5) / 1000.0);
  };
  double position_m = at(0);
  for (int step = 1; step <= 4000; ++step) {
    const double next_m = at(step);
    // the mean of a linear force over the step: its work is exact
    ledger.add(-stiffness_n_per_m * (position_m + next_m) / 2, position_m, next_m, 0.001);
    position_m = next_m;
  }
  EXPECT_EQ(ledger.wholeCycles(), 3U);
  // a passage's own step is split at the middle with the step's mean force, which is off by less than
  // k (25 um)^2 = 4.4e-7 J, the same at each passage
  EXPECT_NEAR(ledger.ofWholeCycles_j(), 0, 1e-9);
  EXPECT_NEAR(ledger.total_j(), 0, 1e-12);
}

TEST(EnergyLedger, OfASampledDelayedSpringIsTheClosedFormOfAForcedSine) {
  // Motion A sin(wt), force -K x(floor(t/T) T - n T). Work per cycle = pi K A^2 sinc(wT/2) sin(w (T/2 + nT)):
  // the first harmonic of a held signal is sinc(wT/2) as large and T/2 late.
  const double stiffness = 800, amplitude_m = 0.003, period_s = 0.001;
  const int delay = 3, ticks_per_cycle = 40;
  const double turn_per_s = 2 * std::numbers::pi / (ticks_per_cycle * period_s);
  const auto at = [&](int tick) { return amplitude_m * std::sin(turn_per_s * period_s * tick); };
  EnergyLedger ledger;
  for (int tick = -1; tick < 10 * ticks_per_cycle + 1; ++tick) {
    ledger.add(-stiffness * at(tick - delay), at(tick), at(tick + 1), 0);
  }
  const double half = turn_per_s * period_s / 2;
  const double expected_j = std::numbers::pi * stiffness * amplitude_m * amplitude_m * std::sin(half) / half *
                            std::sin(turn_per_s * period_s * (0.5 + delay));
  EXPECT_NEAR(ledger.ofWholeCycles_j() / static_cast<double>(ledger.wholeCycles()), expected_j, 1e-9);
}

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

TEST(FindLimit, SeesALimitCycleThatTheWallFeedsBeyondTheLimit) {
  const LoopLimit limit = limitOf("reference", 1, 0, 2);
  EXPECT_FALSE(limit.beyond.stable);
  EXPECT_FALSE(limit.beyond.ran_away);
  EXPECT_GT(limit.beyond.energy_per_cycle_j, 0);
  // what the wall gives the hand's and the device's damping takes: 4.05 N s/m times the mean square of the
  // speed of a motion that is no pure sine, hence the wide bound
  const double amplitude_m = limit.beyond.peak_to_peak_m / 2;
  const double speed = 2 * std::numbers::pi * limit.beyond.cycles_per_s * amplitude_m;
  EXPECT_NEAR(limit.beyond.mean_power_w, 4.05 * speed * speed / 2, 0.2 * limit.beyond.mean_power_w);
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

}  // namespace
}  // namespace hapticd::tools
