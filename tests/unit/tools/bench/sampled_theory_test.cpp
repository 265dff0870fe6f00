// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::tools {
namespace {

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
