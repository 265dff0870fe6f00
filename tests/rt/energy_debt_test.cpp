// SPDX-License-Identifier: Apache-2.0
#include "rt/safety/passivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "tests/rt/fixture_core.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::EnergyDebt;
using rt::Mode;
using rt::Tick;

constexpr double kAllowed_j = 0.01;

TEST(EnergyDebt, EndsTheForceUntilItHasBeenZeroForASecond) {
  EnergyDebt debt;
  EXPECT_FALSE(debt.follow(-0.0099, kAllowed_j, false, 0, kPeriod_s));
  EXPECT_TRUE(debt.follow(-0.0101, kAllowed_j, false, 0, kPeriod_s));
  EXPECT_TRUE(debt.follow(0, kAllowed_j, false, 0, kPeriod_s)) << "it fades out";
  for (int i = 0; i < 999; ++i) EXPECT_TRUE(debt.follow(-0.0101, kAllowed_j, true, 0, kPeriod_s));
  debt.follow(-0.0101, kAllowed_j, true, 0, kPeriod_s);
  EXPECT_FALSE(debt.follow(-0.0101, kAllowed_j, true, 0, kPeriod_s));
  EXPECT_FALSE(debt.follow(-0.02, kAllowed_j, false, 0, kPeriod_s)) << "counted from where the force began";
  EXPECT_TRUE(debt.follow(-0.0202, kAllowed_j, false, 0, kPeriod_s));
}

TEST(EnergyDebt, LastsWhenItComesAgainWithinAMinuteUntilAPersonAsks) {
  for (const double between_s : {2.0, 59.0, 61.0}) {
    EnergyDebt debt;
    const auto zeroFor = [&](double time_s, std::uint64_t request) {
      bool held = true;
      for (int i = 0; i < std::lround(time_s / kPeriod_s); ++i)
        held = debt.follow(0, kAllowed_j, true, request, kPeriod_s);
      return held;
    };
    EXPECT_TRUE(debt.follow(-0.02, kAllowed_j, false, 1, kPeriod_s));
    EXPECT_FALSE(zeroFor(between_s, 1));
    EXPECT_TRUE(debt.follow(-0.02, kAllowed_j, false, 1, kPeriod_s));
    EXPECT_EQ(zeroFor(600, 1), between_s < 60) << between_s;
    EXPECT_FALSE(zeroFor(2, 2)) << between_s;
  }
}

TEST(EnergyDebt, LetsASurplusCount) {
  EnergyDebt debt;
  EXPECT_FALSE(debt.follow(0.005, kAllowed_j, true, 0, kPeriod_s));
  EXPECT_FALSE(debt.follow(-0.0099, kAllowed_j, false, 0, kPeriod_s));
  EXPECT_TRUE(debt.follow(-0.0101, kAllowed_j, false, 0, kPeriod_s));
}

/// Whoever goes deeper while the clutch is held and is pushed out after it gets the energy of the spring each
/// time, which is no instability.
TEST(EnergyDebt, DoesNotAddUpOverPausesOfTheForce) {
  FixtureCore core;
  core.add(rt::FixtureKind::plane, floor()).stiffness_n_per_m = 600;
  core.engage({0, 0, 0.001});
  double given_j = 0;
  for (int cycle = 0; cycle < 20; ++cycle) {
    core.rig.handle.condition = rt::HandleCondition::not_calibrated;
    for (int i = 0; i < 200; ++i) {
      const Tick tick = core.at({0, 0, 0.001 - 0.005 * i / 200});
      EXPECT_EQ(tick.cause, Cause::handle_not_calibrated);
    }
    core.rig.handle.condition = rt::HandleCondition::ready;
    for (int i = 0; i < 3000; ++i) core.at({0, 0, -0.004});
    const double before_j = core.at({0, 0, -0.004}).energy_j;
    Tick tick;
    for (int i = 0; i < 200; ++i) tick = core.at({0, 0, -0.004 + 0.005 * i / 200});
    EXPECT_EQ(tick.mode, Mode::engaged) << "cycle " << cycle;
    given_j += before_j - tick.energy_j;
  }
  EXPECT_GT(given_j, 0.05) << "several times what may be owed at once";
}

}  // namespace
}  // namespace hapticd::test
