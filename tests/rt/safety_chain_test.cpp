// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

#include "rt/safety/force_limit.h"
#include "rt/safety/passivity.h"
#include "rt/safety/safety_chain.h"
#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::EnergyDebt;
using rt::Mode;
using rt::SafetyChain;
using rt::SafetyParameters;
using rt::Tick;
using rt::Vec3;

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

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// A few roundings of numbers of the size of the forces.
constexpr double kRounding = 1e-12;

SafetyParameters limits(double max_force_n, double max_slew_n_per_s) {
  SafetyParameters parameters;
  parameters.max_force_n = max_force_n;
  parameters.max_slew_n_per_s = max_slew_n_per_s;
  return parameters;
}

/// Passes forces to a chain and checks every output against the chain's guarantees.
class CheckedChain {
 public:
  SafetyChain::Output apply(const Vec3& force_n, const SafetyParameters& parameters) {
    const Vec3 before = chain_.lastForce_n_in_world();
    const SafetyChain::Output out = chain_.apply(force_n, parameters, kPeriod_s);
    const Vec3& after = out.force_n_in_world;
    const double largest_n = std::max(parameters.max_force_n, norm(before));
    const double largest_step_n = parameters.max_slew_n_per_s * kPeriod_s;
    EXPECT_TRUE(isFinite(after));
    EXPECT_LE(norm(after),
              std::max(parameters.max_force_n, norm(before) - largest_step_n) + kRounding * largest_n)
        << "no longer than the limit, or approaching it";
    EXPECT_LE(norm(after - before), largest_step_n * (1 + kRounding) + kRounding * largest_n);
    EXPECT_EQ(after, chain_.lastForce_n_in_world());
    return out;
  }

  /// Applies the same force until the output is constant except for rounding.
  Vec3 settle(const Vec3& force_n, const SafetyParameters& parameters) {
    Vec3 last = apply(force_n, parameters).force_n_in_world;
    for (int tick = 0; tick < 1'000; ++tick) {
      const Vec3 next = apply(force_n, parameters).force_n_in_world;
      if (norm(next - last) <= kRounding) return next;
      last = next;
    }
    ADD_FAILURE() << "the force does not settle";
    return last;
  }

 private:
  SafetyChain chain_;
};

void expectNear(const Vec3& actual, const Vec3& expected) {
  EXPECT_LE(norm(actual - expected), kRounding * (1 + norm(expected)))
      << actual.x << ' ' << actual.y << ' ' << actual.z;
}

TEST(SafetyChain, StartsAtZero) {
  const SafetyChain chain;
  EXPECT_EQ(chain.lastForce_n_in_world(), Vec3{});
}

TEST(SafetyChain, PassesSmallSlowForcesUnchangedAndCountsNothing) {
  CheckedChain chain;
  for (int tick = 0; tick <= 1'000; ++tick) {
    const Vec3 force{0.001 * tick, -0.0005 * tick, 0.0001 * tick};
    const SafetyChain::Output out = chain.apply(force, limits(4, 500));
    expectNear(out.force_n_in_world, force);
    EXPECT_FALSE(out.slew_limited || out.magnitude_clamped || out.not_finite);
  }
}

TEST(SafetyChain, ApproachesAJumpAtTheSlewLimitAndReportsIt) {
  CheckedChain chain;
  for (int tick = 1; tick <= 6; ++tick) {
    const SafetyChain::Output out = chain.apply({0, 3, 0}, limits(4, 500));
    expectNear(out.force_n_in_world, {0, 0.5 * tick, 0});
    EXPECT_TRUE(out.slew_limited || tick == 6) << "only the last step is a short one";
    EXPECT_FALSE(out.magnitude_clamped);
  }
  EXPECT_FALSE(chain.apply({0, 3, 0}, limits(4, 500)).slew_limited);
}

TEST(SafetyChain, KeepsTheDirectionOfAForceThatItShortens) {
  CheckedChain chain;
  expectNear(chain.settle({30, 0, 40}, limits(4, 500)), {2.4, 0, 3.2});
  EXPECT_TRUE(chain.apply({30, 0, 40}, limits(4, 500)).magnitude_clamped);
}

TEST(SafetyChain, ApproachesALoweredLimitAtTheSlewLimit) {
  CheckedChain chain;
  chain.settle({10, 0, 0}, limits(8, 500));
  for (int tick = 1; tick <= 12; ++tick) {
    const SafetyChain::Output out = chain.apply({10, 0, 0}, limits(2, 500));
    expectNear(out.force_n_in_world, {8 - 0.5 * tick, 0, 0});
  }
  expectNear(chain.apply({10, 0, 0}, limits(2, 500)).force_n_in_world, {2, 0, 0});
}

TEST(SafetyChain, DoesNotStepFurtherWhenALoweredLimitAndANewAimComeTogether) {
  // Inwards to the limit and sideways to the aim: each alone is a full step. CheckedChain verifies the
  // result.
  CheckedChain chain;
  chain.settle({10, 0, 0}, limits(8, 500));
  for (int tick = 0; tick < 100; ++tick) chain.apply({0, 10, 0}, limits(1, 500));
  expectNear(chain.settle({0, 10, 0}, limits(1, 500)), {0, 1, 0});
}

TEST(SafetyChain, AppliesALoweredLimitAtOnceToAForceWithinIt) {
  CheckedChain chain;
  chain.settle({1, 0, 0}, limits(40, 500));
  expectNear(chain.settle({30, 0, 0}, limits(2, 500)), {2, 0, 0});
}

TEST(SafetyChain, FollowsARaisedLimitAtOnce) {
  CheckedChain chain;
  chain.settle({10, 0, 0}, limits(2, 500));
  expectNear(chain.apply({10, 0, 0}, limits(8, 500)).force_n_in_world, {2.5, 0, 0});
}

TEST(SafetyChain, AimsAtZeroForNonFiniteInputAndReportsIt) {
  for (const Vec3& bad : {Vec3{kNaN, 0, 0}, Vec3{0, kInfinity, 0}, Vec3{0, 0, -kInfinity},
                          Vec3{kNaN, kInfinity, 1}, Vec3{1e308, 1e308, 1e308}, Vec3{0, -1e200, 0}}) {
    CheckedChain chain;
    chain.settle({3, 0, 0}, limits(4, 500));
    const SafetyChain::Output out = chain.apply(bad, limits(4, 500));
    EXPECT_TRUE(out.not_finite);
    expectNear(out.force_n_in_world, {2.5, 0, 0});
    EXPECT_EQ(chain.settle(bad, limits(4, 500)), Vec3{});
    EXPECT_FALSE(chain.apply({1, 0, 0}, limits(4, 500)).not_finite) << "the memory must stay clean";
  }
}

TEST(SafetyChain, GoesToExactlyZero) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-5, 5);
  for (int round = 0; round < 1'000; ++round) {
    CheckedChain chain;
    const SafetyParameters parameters = limits(4, 500);
    chain.settle({coordinate(random), coordinate(random), coordinate(random)}, parameters);
    ASSERT_EQ(chain.settle({}, parameters), Vec3{});
  }
}

TEST(SafetyChain, CommandsNothingWhenNoForceOrNoSlewIsAllowed) {
  CheckedChain chain;
  EXPECT_EQ(chain.settle({1, 2, 3}, limits(0, 500)), Vec3{});
  EXPECT_EQ(chain.settle({1, 2, 3}, limits(4, 0)), Vec3{});
}

/// Values that break arithmetic, mixed with ordinary ones.
class Adversary {
 public:
  explicit Adversary(std::uint32_t seed) : random_(seed) {}

  double number() {
    static constexpr std::array kHard = {0.0,
                                         -0.0,
                                         kNaN,
                                         kInfinity,
                                         -kInfinity,
                                         1e308,
                                         -1e308,
                                         1.7e154,
                                         1e150,
                                         -1e100,
                                         1e-160,
                                         5e-324,
                                         -5e-324,
                                         std::numeric_limits<double>::min(),
                                         std::numeric_limits<double>::max(),
                                         std::numeric_limits<double>::epsilon()};
    if (chance(0.1)) return kHard[std::uniform_int_distribution<std::size_t>(0, kHard.size() - 1)(random_)];
    return std::uniform_real_distribution<double>(-10, 10)(random_);
  }
  /// Jumps, repeats itself, reverses.
  Vec3 force() {
    if (chance(0.3)) last_ = {number(), number(), number()};
    if (chance(0.1)) last_ = -last_;
    return last_;
  }
  /// Within the range of the parameter table and beyond it.
  SafetyParameters limits() {
    if (chance(0.02)) max_force_n_ = spread(1e-3, 1e3);
    if (chance(0.02)) max_slew_n_per_s_ = spread(1e-2, 1e6);
    return test::limits(max_force_n_, max_slew_n_per_s_);
  }

 private:
  bool chance(double probability) { return std::bernoulli_distribution(probability)(random_); }
  double spread(double low, double high) {
    return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(random_));
  }
  std::mt19937_64 random_;
  Vec3 last_;
  double max_force_n_ = 4;
  double max_slew_n_per_s_ = 500;
};

TEST(SafetyChain, KeepsItsGuaranteesAgainstAdversarialSequences) {
  for (std::uint32_t seed = 0; seed < 50 && !testing::Test::HasFailure(); ++seed) {
    Adversary adversary(seed);
    CheckedChain chain;
    for (int tick = 0; tick < 4'000; ++tick) chain.apply(adversary.force(), adversary.limits());
  }
}

TEST(SafetyChain, IsWithinTheLimitAfterTheTimeNeededToApproachIt) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    Adversary adversary(seed);
    CheckedChain chain;
    const SafetyParameters low = limits(1, 500);
    chain.settle({20, 0, 0}, limits(16, 500));
    for (int tick = 0; tick < 30; ++tick) chain.apply(adversary.force(), low);  // 15 N in steps of 0.5 N
    for (int tick = 0; tick < 500; ++tick) {
      ASSERT_LE(norm(chain.apply(adversary.force(), low).force_n_in_world), 1 + kRounding);
    }
  }
}

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
