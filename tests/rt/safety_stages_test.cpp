// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "rt/safety/force_limit.h"
#include "rt/safety/passivity.h"
#include "rt/safety/safety_chain.h"
#include "rt/safety/stiffness_limit.h"

// Each stage of the safety chain alone; safety_chain_test.cpp tests the whole chain.
namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr double kPeriod_s = 0.001;

TEST(ThermalLimit, IsColdAfterALongRest) {
  rt::ThermalLimit thermal;
  thermal.heat(4, 0.01, kPeriod_s);
  for (int tick = 0; tick < 2000; ++tick) thermal.heat(0, 0.01, kPeriod_s);
  EXPECT_EQ(thermal.heat_n2(), 0);
}

// ---- Slew limit and magnitude clamp

TEST(ForceLimit, ReachesANearAimInOneStepAndMovesOneStepTowardsAFartherOne) {
  const rt::LimitedForce near = rt::limitForce({0, 0, 1}, {0, 0.3, 1.4}, 0.5, 4);
  EXPECT_EQ(near.force_n, (Vec3{0, 0.3, 1.4})) << "a step of exactly half a newton";
  EXPECT_FALSE(near.slewed || near.clamped);
  const rt::LimitedForce far = rt::limitForce({0, 0, 1}, {0, 3, 5}, 0.5, 4);
  EXPECT_LT(norm(far.force_n - Vec3{0, 0.3, 1.4}), 1e-15);
  EXPECT_TRUE(far.slewed);
  EXPECT_FALSE(far.clamped);
}

TEST(ForceLimit, CutsToTheLargestForceAndKeepsTheDirection) {
  const rt::LimitedForce cut = rt::limitForce({}, {3, 0, 4}, 100, 2);
  EXPECT_LT(norm(cut.force_n - Vec3{1.2, 0, 1.6}), 1e-15);
  EXPECT_EQ(cut.slewed_force_n, (Vec3{3, 0, 4})) << "before the clamp";
  EXPECT_TRUE(cut.clamped);
  EXPECT_FALSE(cut.slewed);
}

TEST(ForceLimit, ReducesAForceAboveALoweredMaximumByAtMostOneStep) {
  EXPECT_EQ(rt::limitForce({0, 0, 4}, {0, 0, 4}, 0.5, 1).force_n, (Vec3{0, 0, 3.5}));
  EXPECT_EQ(rt::limitForce({0, 0, 1.2}, {0, 0, 4}, 0.5, 1).force_n, (Vec3{0, 0, 1}));
}

// ---- Thermal limit

TEST(ThermalLimit, AllowsThePeakFromColdForAsLongAsTheModelPredicts) {
  rt::ThermalLimit thermal;
  int ticks = 0;
  while (thermal.limit_n(4, 1) == 4) {
    thermal.heat(4, 10, kPeriod_s);
    ++ticks;
  }
  // h = 16 (1 - e^(-t/10)) reaches 0.9
  EXPECT_NEAR(ticks * kPeriod_s, -10 * std::log(1 - 0.9 / 16), kPeriod_s);
}

TEST(ThermalLimit, NeverLetsTheMeanSquareExceedTheContinuousForceForAnyRequest) {
  for (const double requested_n : {0.5, 1.5, 4.0, 40.0}) {
    rt::ThermalLimit thermal;
    double last_n = 0;
    for (int tick = 0; tick < 200'000; ++tick) {
      last_n = std::min(requested_n, thermal.limit_n(4, 1.5));
      thermal.heat(last_n, 2, kPeriod_s);
      ASSERT_LE(thermal.heat_n2(), 1.5 * 1.5 * (1 + 1e-12));
    }
    EXPECT_NEAR(last_n, std::min(requested_n, 1.5), 1e-6) << "what it bears for ever remains";
  }
}

TEST(ThermalLimit, CoolsDownWithItsTimeConstant) {
  rt::ThermalLimit thermal;
  for (int tick = 0; tick < 100'000; ++tick) thermal.heat(1, 5, kPeriod_s);
  for (int tick = 0; tick < 5'000; ++tick) thermal.heat(0, 5, kPeriod_s);
  EXPECT_NEAR(thermal.heat_n2(), std::exp(-1), 1e-6);
}

// ---- Stiffness limit

/// Returns whether the sampled loop of a mass m with damping b against the spring K settles, with the force
/// held for a period and n periods late: x'' = -b x' - F, using the exact solution over each period.
bool settles(double stiffness, double damping, double mass, int delay_ticks) {
  const double decay = std::exp(-damping / mass * kPeriod_s);
  double x = 0.001;
  double v = 0;
  std::array<double, 16> forces{};
  double early = 0;
  double late = 0;
  for (int tick = 0; tick < 400'000; ++tick) {
    forces[static_cast<std::size_t>(tick % 16)] = -stiffness * x;
    const double force = tick < delay_ticks ? 0 : forces[static_cast<std::size_t>((tick - delay_ticks) % 16)];
    const double end_speed = force / damping;
    x += end_speed * kPeriod_s + (v - end_speed) * mass / damping * (1 - decay);
    v = end_speed + (v - end_speed) * decay;
    if (!(std::abs(x) < 1e6)) return false;
    double& largest = tick < 200'000 ? early : late;
    if (tick % 200'000 > 150'000) largest = std::max(largest, std::abs(x));
  }
  return late <= early;
}

double lagOf(int delay_ticks) {
  return rt::loopLag_s(kPeriod_s, delay_ticks * kPeriod_s, 0);
}

TEST(StiffnessLimit, IsWhereADelayedSpringStartsToOscillate) {
  for (const int delay_ticks : {0, 1, 2, 5}) {
    const double limit = rt::largestStableStiffness_n_per_m(0.5, 0, lagOf(delay_ticks));
    EXPECT_TRUE(settles(0.95 * limit, 0.5, 0.045, delay_ticks)) << delay_ticks;
    EXPECT_FALSE(settles(1.05 * limit, 0.5, 0.045, delay_ticks)) << delay_ticks;
  }
}

TEST(StiffnessLimit, CountsTheLowPassAsDelay) {
  EXPECT_DOUBLE_EQ(rt::loopLag_s(0.001, 0.002, 0), 0.0025);
  EXPECT_DOUBLE_EQ(rt::loopLag_s(0.001, 0.002, 50), 0.0025 + 1 / (2 * std::numbers::pi * 50));
  EXPECT_DOUBLE_EQ(rt::loopLag_s(0.001, -1, 0), 0.0005) << "a negative delay counts as zero";
}

/// The least K in units of m / lag^2 at which m w^2 = K (1 + c j w lag e^(-j w velocity_lag)) e^(-j w lag)
/// has a solution, where spring and damper sustain an oscillation of the mass; c: kContactDamping. `ratio`:
/// velocity_lag / lag.
double oscillatesAt(double ratio) {
  const auto response = [ratio](double turn) {  // turn: w lag
    return (1.0 + std::polar(rt::kContactDamping * turn, std::numbers::pi / 2 - ratio * turn)) *
           std::polar(1.0, -turn);
  };
  double turn = 0.001;
  while (std::arg(response(turn)) > 0) turn += 1e-4;
  return turn * turn / std::abs(response(turn));
}

TEST(StiffnessLimit, LeavesTheMassAMarginToTheLimitsOfStability) {
  const double prompt = oscillatesAt(0);
  EXPECT_NEAR(prompt, 0.55, 0.005) << "as stated in the header";
  EXPECT_LT(rt::kStiffnessOfMass, prompt / 1.5);
  EXPECT_DOUBLE_EQ(rt::stiffnessOfMass_n_per_m(0.045, 0.01), 0.35 * 0.045 / 1e-4);
  for (double lag_s = 0.0005; lag_s < 0.05; lag_s *= 1.1) {
    const double limit = oscillatesAt(rt::kVelocityLag_s / lag_s) * 0.045 / (lag_s * lag_s);
    EXPECT_NEAR(rt::oscillatingStiffness_n_per_m(0.045, lag_s, rt::kVelocityLag_s), limit, 0.015 * limit)
        << lag_s;
    EXPECT_LT(rt::stiffnessOfMass_n_per_m(0.045, lag_s), 0.9 * limit) << lag_s;
    const double damper = std::numbers::pi / 2 * 0.045 / (lag_s + rt::kVelocityLag_s);
    EXPECT_LT(rt::largestDamping_n_s_per_m(0.045, lag_s), 0.61 * damper) << lag_s;
  }
}

// ---- Contact damping

TEST(ContactDamping, ActsAlongTheNormalAndNeverPulls) {
  const auto with = [](const Vec3& velocity, double damping) {
    return rt::damped({{0, 0, 3}, {0, 0, 1}, velocity}, damping);
  };
  EXPECT_EQ(with({0, 0, 0.1}, 5), (Vec3{0, 0, 2.5}));
  EXPECT_EQ(with({0, 0, -0.1}, 5), (Vec3{0, 0, 3.5}));
  EXPECT_EQ(with({0, 0, 1}, 5), Vec3{}) << "the surface would have to pull";
  EXPECT_EQ(with({1, -1, 0}, 5), (Vec3{0, 0, 3})) << "without friction nothing along the surface";
  EXPECT_EQ(rt::damped({{}, {0, 0, 1}, {0, 0, -1}}, 5), Vec3{}) << "no contact, no damping";
  EXPECT_EQ(rt::damped({{0, 0, -3}, {0, 0, 1}, {0, 0, -1}}, 5), (Vec3{0, 0, -3}))
      << "a force inwards is no contact";
}

TEST(ContactDamping, UsesTheForceAsNormalWhereThereIsNone) {
  EXPECT_LT(norm(rt::damped({{3, 0, 4}, {}, {0.6, 0, 0.8}}, 2) - Vec3{1.8, 0, 2.4}), 1e-15);
}

TEST(ContactDamping, ActsAcrossTheNormalWhereTheProxyStays) {
  rt::ProxyGrip grip;
  grip.begin({0, 0, 1});
  grip.follow({1e-3, 0, 0}, {}, 1e-4);            // it stays along x ...
  grip.follow({0, 1e-3, 0}, {0, 1e-3, 0}, 1e-4);  // ... and goes along y
  const auto with = [&](const Vec3& velocity) {
    return rt::damped({{0, 0, 4}, {0, 0, 1}, velocity, 5, grip.across({0, 0, 1})}, 2);
  };
  EXPECT_LT(norm(with({0.1, 0, 0}) - Vec3{-0.5, 0, 4}), 1e-12);
  EXPECT_LT(norm(with({0, 0.1, 0.1}) - Vec3{0, 0, 3.8}), 1e-12);
  EXPECT_NEAR(norm(with({100, 0, 0}) - Vec3{0, 0, 4}), rt::kDampingOfSpring * 4, 1e-9) << "at most";
}

// ---- Command history

TEST(CommandHistory, ReturnsTheCommandOfOneDelayAgo) {
  rt::CommandHistory history;
  EXPECT_EQ(history.acting_n(0.05, kPeriod_s), Vec3{});
  for (int tick = 1; tick <= 300; ++tick) history.add({static_cast<double>(tick), 0, 0});
  EXPECT_EQ(history.acting_n(0, kPeriod_s).x, 300);
  EXPECT_NEAR(history.acting_n(0.007, kPeriod_s).x, 293, 1e-9);
  EXPECT_NEAR(history.acting_n(0.0072, kPeriod_s).x, 292.8, 1e-9);
  EXPECT_EQ(history.acting_n(10, kPeriod_s).x, 300 - 127) << "as long as it remembers";
  EXPECT_EQ(history.acting_n(-1, kPeriod_s).x, 300);
  EXPECT_EQ(history.acting_n(std::nan(""), kPeriod_s).x, 300);
  history.add({});
  EXPECT_EQ(history.largest_n(0, kPeriod_s), 0);
  EXPECT_EQ(history.largest_n(0.001, kPeriod_s), 300);
}

// ---- Passivity control

/// A mass with damping, held by a hand (spring and damper to its target), against a wall at 0 that acts as a
/// spring. The device exerts the force commanded `delay_ticks` ticks ago.
struct WallLoop {
  double mass_kg = 0.045;
  double damping = 0.05;
  double hand_stiffness = 0;
  double hand_damping = 0;
  double stiffness = 100;
  int delay_ticks = 0;
  rt::SafetyParameters safety = [] {
    rt::SafetyParameters parameters;
    parameters.max_force_n = 1000;
    parameters.max_slew_n_per_s = 1e9;
    parameters.continuous_force_n = 1000;
    return parameters;
  }();

  struct Result {
    double late_oscillation_m = 0;  ///< largest displacement between two turning points in the last second
    double given_j = 0;             ///< largest energy that the box has given in excess of what it got
    double acted_share = 0;         ///< fraction of ticks
    double largest_force_n = 0;
  };

  /// `target`: target position of the hand as a function of time.
  template <typename Target>
  Result run(double seconds, double x, double v, Target target) {
    rt::SafetyChain chain;
    Result result;
    std::array<double, 16> commands{};
    double energy_j = 0;
    double low = 1e9;
    double high = -1e9;
    double before = x;
    double exerted = 0;
    int acted = 0;
    const int ticks = static_cast<int>(seconds / kPeriod_s);
    for (int tick = 0; tick < ticks; ++tick) {
      const double spring = x < 0 ? -stiffness * x : 0;
      energy_j += exerted * (x - before);
      result.given_j = std::max(result.given_j, energy_j);
      rt::SafetyChain::Motion motion{{0, 0, x - before}, {0, 0, v}, 0, stiffness, damping, 0.5};
      motion.delay_s = delay_ticks * kPeriod_s;
      motion.known = true;
      const rt::SafetyChain::Output out = chain.apply({0, 0, spring}, safety, kPeriod_s, motion);
      before = x;
      acted += out.passivity_acted ? 1 : 0;
      commands[static_cast<std::size_t>(tick % 16)] = out.force_n_in_world.z;
      exerted = tick < delay_ticks ? 0 : commands[static_cast<std::size_t>((tick - delay_ticks) % 16)];
      result.largest_force_n = std::max(result.largest_force_n, std::abs(exerted));
      for (int part = 0; part < 20; ++part) {  // the hand and the device are not sampled
        const double dt = kPeriod_s / 20;
        const double hand = hand_stiffness * (target(tick * kPeriod_s) - x) - hand_damping * v;
        v += dt * (exerted + hand - damping * v) / mass_kg;
        x += dt * v;
      }
      if (tick >= ticks - 1000) {
        low = std::min(low, x);
        high = std::max(high, x);
      }
    }
    result.late_oscillation_m = high - low;
    result.acted_share = static_cast<double>(acted) / ticks;
    return result;
  }
};

/// A weak grip: (0.05 + 1) / (T / 2) = 2100 N/m are stable.
WallLoop weakGrip(double times) {
  WallLoop loop;
  loop.hand_stiffness = 100;
  loop.hand_damping = 1;
  loop.stiffness = times * 2100;
  return loop;
}

/// No hand, but a weight of 0.1 N that presses the handle on: 0.05 / (T / 2) = 100 N/m are stable.
WallLoop releasedStylus(double times) {
  WallLoop loop;
  loop.hand_stiffness = 1;  // at 0.1 m
  loop.stiffness = times * 100;
  return loop;
}

void expectSettledByPassivityControl(WallLoop loop, double target_m) {
  const auto pressing = [=](double) { return target_m; };
  loop.safety.passivity_control = false;
  const WallLoop::Result without = loop.run(20, 0, -0.05, pressing);
  loop.safety.passivity_control = true;
  const WallLoop::Result with = loop.run(20, 0, -0.05, pressing);
  EXPECT_GT(without.late_oscillation_m, 0.002) << "oscillates";
  EXPECT_LT(with.late_oscillation_m, 0.05 * without.late_oscillation_m);
  EXPECT_LT(with.given_j, 0.05 * without.given_j);
}

TEST(Passivity, ThreeTimesOverTheStableLimitAReleasedStylusOscillatesWithoutItAndNotWithIt) {
  expectSettledByPassivityControl(releasedStylus(3), -0.1);
}

TEST(Passivity, ThreeTimesOverTheStableLimitAWeakGripOscillatesWithoutItAndNotWithIt) {
  expectSettledByPassivityControl(weakGrip(3), -0.02);
}

// b > K T / 2 of the device alone: the hand gets back all the energy that it gave. Taps of 1 cm, once a
// second.
TEST(Passivity, ActsOnLessThanOnePercentOfTicksOnPassiveCases) {
  const auto tapping = [](double t) { return 0.01 * std::cos(2 * std::numbers::pi * t); };
  for (const double times : {0.1, 0.5, 0.95}) {
    WallLoop loop = weakGrip(1);
    loop.damping = 0.3;
    loop.stiffness = times * 2 * loop.damping / kPeriod_s;
    const WallLoop::Result result = loop.run(20, 0.01, 0, tapping);
    EXPECT_LT(result.acted_share, 0.01) << times;
    EXPECT_GT(result.largest_force_n, 0.2) << "there was contact";
  }
}

rt::Passivity::Input still(double force_n) {
  return {{0, 0, force_n}, {0, 0, force_n}, {}, {}, 0, 500, 0, 0.5, kPeriod_s};
}

// A surface that rises by 1 mm per tick under 2 N: at most 2 mJ are credited per tick, 1 mJ at 0.5 m/s.
TEST(Passivity, LetsAMovingSurfaceLiftTheHandNoFasterThanItMayMove) {
  const rt::SafetyParameters parameters;
  for (const double lift_m_per_s : {0.4, 0.8}) {
    rt::Passivity passivity;
    int acted = 0;
    for (int tick = 0; tick < 100; ++tick) {
      rt::Passivity::Input input = still(2);
      input.motion_m = {0, 0, lift_m_per_s * kPeriod_s};
      input.velocity_m_per_s = {0, 0, lift_m_per_s};
      input.surface_work_j = 2 * lift_m_per_s * kPeriod_s;
      acted += passivity.apply(input, parameters).acted ? 1 : 0;
    }
    if (lift_m_per_s < 0.5) {
      EXPECT_EQ(acted, 0);
    } else {
      EXPECT_GT(acted, 90);
    }
  }
}

TEST(Passivity, DebitsTheWorkOfASinkingSurfaceAtOnce) {
  rt::Passivity passivity;
  rt::Passivity::Input input = still(2);
  input.motion_m = {0, 0, -0.001};
  passivity.apply(input, {});
  EXPECT_NEAR(passivity.energy_j(), 0.002, 1e-15);
  input = still(2);
  input.surface_work_j = -0.0015;
  passivity.apply(input, {});
  EXPECT_NEAR(passivity.energy_j(), 0.0005, 1e-15);
}

TEST(Passivity, DampsTheMotionByNoMoreThanTheLimit) {
  rt::Passivity passivity;
  rt::SafetyParameters parameters;
  rt::Passivity::Input input = still(2);
  input.motion_m = {0, 0, 0.01};
  input.velocity_m_per_s = {0.03, 0, 0.1};
  rt::Passivity::Output out = passivity.apply(input, parameters);
  EXPECT_TRUE(out.acted);
  EXPECT_NEAR(norm(out.force_n - Vec3{-0.15, 0, 2 - 0.5}), 0, 1e-15) << "5 N s/m in every direction";
  input.max_damping_n_s_per_m = 3;  // limit from the loop's lag
  EXPECT_NEAR(passivity.apply(input, parameters).force_n.z, 2 - 0.3, 1e-15);
  input.max_damping_n_s_per_m = 1e9;
  input.force_n = {};
  EXPECT_EQ(passivity.apply(input, parameters).force_n, Vec3{}) << "no force without contact";
  input.force_n = {0, 0, 2};
  input.max_damping_n_s_per_m = 0;
  EXPECT_FALSE(passivity.apply(input, parameters).acted);
}

rt::Passivity::Input movingFreely() {
  rt::Passivity::Input input = still(0);
  input.motion_m = {0, 0, 1e-4};
  input.velocity_m_per_s = {0, 0, 0.1};
  return input;
}

TEST(Passivity, KeepsADebtBeyondTheEndOfTheContactAsLongAsTheHandMoves) {
  rt::Passivity passivity;
  rt::Passivity::Input input = still(2);
  input.motion_m = {0, 0, 0.01};
  passivity.apply(input, {});
  EXPECT_NEAR(passivity.energy_j(), -0.02, 1e-15);
  for (int tick = 0; tick < 10'000; ++tick) passivity.apply(movingFreely(), {});
  EXPECT_NEAR(passivity.energy_j(), -0.02, 1e-15);
  input = still(2);
  input.velocity_m_per_s = {0, 0, -0.1};
  EXPECT_GT(passivity.apply(input, {}).force_n.z, 2) << "the next contact begins with it";
}

TEST(Passivity, CarriesNoCreditFromAnEndedContactToTheNext) {
  rt::Passivity passivity;
  rt::Passivity::Input input = still(2);
  input.motion_m = {0, 0, -0.001};
  passivity.apply(input, {});
  EXPECT_GT(passivity.energy_j(), 0);
  passivity.apply(still(0), {});
  EXPECT_EQ(passivity.energy_j(), 0);
}

TEST(Passivity, LetsADebtDecayOnlyWhileTheHandIsAtRest) {
  const auto debtAfter = [](rt::Passivity::Input next) {
    rt::Passivity passivity;
    rt::Passivity::Input input = still(2);
    input.motion_m = {0, 0, 0.01};
    passivity.apply(input, {});
    for (int tick = 0; tick < 5'000; ++tick) {
      next.motion_m = -next.motion_m;
      passivity.apply(next, {});
    }
    return passivity.energy_j();
  };
  rt::Passivity::Input next = still(0);
  EXPECT_GT(debtAfter(next), -1e-5) << "5 s, of which 0.2 s are for being sure";
  next.motion_m = {0, 0, 55e-6};
  EXPECT_GT(debtAfter(next), -1e-5) << "an encoder that flickers";
  next.motion_m = {0, 0, 3e-4};
  EXPECT_NEAR(debtAfter(next), -0.02, 1e-15);
  next.motion_m = {};
  next.motion_known = false;
  EXPECT_NEAR(debtAfter(next), -0.02, 1e-15);
}

// With a delay of 20 ms, 2 N act while the hand moves out by 1 mm, although the command is already zero.
TEST(Passivity, CountsTheForceThatActsInsteadOfTheCommandedOne) {
  rt::SafetyChain chain;
  rt::SafetyParameters parameters;
  parameters.max_slew_n_per_s = 1e6;
  rt::SafetyChain::Motion motion{{}, {}, 0, 500, 0, 0.5};
  motion.delay_s = 0.02;
  for (int tick = 0; tick < 21; ++tick) chain.apply({0, 0, 2}, parameters, kPeriod_s, motion);
  chain.apply({}, parameters, kPeriod_s, motion);
  motion.hand_m = {0, 0, 0.001};
  chain.apply({}, parameters, kPeriod_s, motion);
  EXPECT_NEAR(chain.energy_j(), -0.002, 1e-12);
}

TEST(Passivity, KeepsADebtThroughAFaultOfTheHandle) {
  rt::SafetyChain chain;
  rt::SafetyParameters parameters;
  parameters.max_slew_n_per_s = 1e6;
  rt::SafetyChain::Motion motion{{}, {}, 0, 500, 0, 0.5};
  motion.known = true;
  chain.apply({0, 0, 2}, parameters, kPeriod_s, motion);
  motion.hand_m = {0, 0, 0.005};
  chain.apply({0, 0, 2}, parameters, kPeriod_s, motion);
  const double debt_j = chain.energy_j();
  EXPECT_NEAR(debt_j, -0.01, 1e-12);
  for (int tick = 0; tick < 2'000; ++tick) chain.release(parameters, kPeriod_s);
  chain.apply({}, parameters, kPeriod_s);
  EXPECT_EQ(chain.energy_j(), debt_j);
}

TEST(Passivity, KeepsNoMoreThanFourTimesTheEnergyOfASpringUnderTheForce) {
  rt::Passivity passivity;
  for (int tick = 0; tick < 1000; ++tick) {
    rt::Passivity::Input input = still(2);
    input.motion_m = {0, 0, -0.001};
    passivity.apply(input, {});
  }
  EXPECT_NEAR(passivity.energy_j(), 4 * 2.0 * 2.0 / (2 * 500), 1e-12);
}

}  // namespace
}  // namespace hapticd::test
