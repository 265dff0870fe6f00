// SPDX-License-Identifier: Apache-2.0
// A force of another program in the safety chain: what it may do to the hand.
#include "rt/channels/external_force.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <random>

#include "rt/safety/safety_chain.h"

namespace hapticd::test {
namespace {

using rt::EnergyBudget;
using rt::SafetyChain;
using rt::SafetyParameters;
using rt::Vec3;

constexpr double kPeriod_s = 0.001;
constexpr std::int64_t kMs_ns = 1'000'000;
/// A few roundings of numbers of the size of the forces and energies.
constexpr double kRounding = 1e-12;

SafetyParameters allowing(double max_external_force_n, double power_w = 5) {
  SafetyParameters parameters;
  parameters.max_external_force_n = max_external_force_n;
  parameters.max_external_power_w = power_w;
  return parameters;
}

SafetyChain::Motion resting(const Vec3& external_n) {
  SafetyChain::Motion motion;
  motion.known = true;
  motion.external_n_in_world = external_n;
  return motion;
}

TEST(ExternalForce, ActsInFullForTenMillisecondsAndFadesOverTenMore) {
  const rt::ExternalForce force{{0, 2, 0}, 100 * kMs_ns};
  const auto at = [&](std::int64_t now_ns) { return rt::externalForceAt(force, now_ns).y; };
  EXPECT_EQ(at(100 * kMs_ns), 2);
  EXPECT_EQ(at(110 * kMs_ns), 2);
  EXPECT_NEAR(at(115 * kMs_ns), 1, kRounding);
  EXPECT_NEAR(at(119 * kMs_ns), 0.2, kRounding);
  EXPECT_EQ(at(120 * kMs_ns), 0);
  EXPECT_EQ(at(120'000 * kMs_ns), 0);
  EXPECT_EQ(rt::externalForceAt({}, 5 * kMs_ns), Vec3{}) << "none was ever fed";
}

TEST(ExternalForce, IsZeroUnlessAllowedAndCutToWhatIsAllowed) {
  SafetyChain closed;
  EXPECT_EQ(closed.apply({}, allowing(0), kPeriod_s, resting({0, 1, 0})).force_n_in_world, Vec3{});
  SafetyChain chain;
  const SafetyParameters parameters = allowing(0.5);
  Vec3 force;
  for (int i = 0; i < 10; ++i)
    force = chain.apply({}, parameters, kPeriod_s, resting({0, 3, 0})).force_n_in_world;
  EXPECT_NEAR(force.y, 0.5, kRounding);
}

TEST(ExternalForce, IsNothingWhereItIsNotFinite) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::max()}) {
    SafetyChain chain;
    const auto out = chain.apply({0, 0, 1}, allowing(2), kPeriod_s, resting({0, bad, 0}));
    EXPECT_EQ(out.force_n_in_world, (Vec3{0, 0, 1})) << bad;
    EXPECT_FALSE(out.not_finite);
  }
}

/// What a program behind the force may be: all that a person would not want there.
class Controller {
 public:
  explicit Controller(std::mt19937& random)
      : random_(random), kind_(std::uniform_int_distribution(0, 4)(random)) {
    stiffness_n_per_m_ = std::uniform_real_distribution(50.0, 3000.0)(random);
    delay_ticks_ = std::uniform_int_distribution<std::size_t>(0, 60)(random);
    constant_n_ = anyVector(5);
  }
  Vec3 force_n(const Vec3& position_m, const Vec3& velocity_m_per_s) {
    seen_m_.push_back(position_m);
    if (seen_m_.size() > delay_ticks_ + 1) seen_m_.pop_front();
    switch (kind_) {
      case 0:
        return constant_n_;
      case 1:
        return 30 * velocity_m_per_s;  // pushes on
      case 2:
        return -stiffness_n_per_m_ * seen_m_.front();  // a late spring
      case 3:
        return anyVector(8);
      default:
        return norm(velocity_m_per_s) > 0 ? 4 / norm(velocity_m_per_s) * velocity_m_per_s : anyVector(1);
    }
  }

 private:
  Vec3 anyVector(double most) {
    std::uniform_real_distribution<double> any(-most, most);
    const double x = any(random_);
    const double y = any(random_);
    return {x, y, any(random_)};
  }
  std::mt19937& random_;
  int kind_;
  double stiffness_n_per_m_;
  std::size_t delay_ticks_;
  Vec3 constant_n_;
  std::deque<Vec3> seen_m_;
};

TEST(ExternalForce, GivesTheHandNoMoreThanItsBudgetWhateverItsControllerDoes) {
  std::mt19937 random(7);
  double most_used = 0;
  for (int run = 0; run < 400; ++run) {
    const double power_w = std::uniform_real_distribution(0.0, 1.0)(random);
    const double mass_kg = std::uniform_real_distribution(0.05, 0.5)(random);
    const double damping_n_s_per_m = std::uniform_real_distribution(0.0, 3.0)(random);
    const SafetyParameters parameters = allowing(std::uniform_real_distribution(0.5, 6.0)(random), power_w);
    Controller controller(random);
    SafetyChain chain;
    Vec3 position_m{0.001, 0, 0};
    Vec3 velocity;
    Vec3 force_n;
    SafetyChain::Motion motion = resting({});
    double given_j = 0;
    double most_in_a_tick_j = 0;
    for (int tick = 0; tick < 2000; ++tick) {
      // The hand and the handle during the tick, under the force of the tick before.
      const Vec3 before_m = position_m;
      velocity += (kPeriod_s / mass_kg) * (force_n - damping_n_s_per_m * velocity);
      position_m += kPeriod_s * velocity;
      const double work_j = dot(force_n, position_m - before_m);
      given_j += work_j;
      most_in_a_tick_j = std::max(most_in_a_tick_j, work_j);
      const double allowed_j = 2 * EnergyBudget::kReserve_j + power_w * tick * kPeriod_s;
      // Beyond it only what is given while the slew limit brings a force to zero that has overdrawn the
      // budget.
      const double ticks_to_zero =
          1 + parameters.max_external_force_n / (parameters.max_slew_n_per_s * kPeriod_s);
      ASSERT_LE(given_j, allowed_j + ticks_to_zero * most_in_a_tick_j + kRounding)
          << "run " << run << " tick " << tick;
      most_used = std::max(most_used, given_j / allowed_j);

      motion.hand_m = position_m - before_m;
      motion.velocity_m_per_s = velocity;
      motion.external_n_in_world = controller.force_n(position_m, velocity);
      force_n = chain.apply({}, parameters, kPeriod_s, motion).force_n_in_world;
      ASSERT_LE(norm(force_n), parameters.max_external_force_n + kRounding);
    }
  }
  EXPECT_GT(most_used, 0.3) << "the controllers did not try";
}

TEST(ExternalForce, OfAPassiveSpringIsNotLimited) {
  // A hand that moves slowly in and out of a spring in another program, without delay: what it gives is given
  // back.
  const SafetyParameters parameters = allowing(4, 0.2);
  SafetyChain chain;
  SafetyChain::Motion motion = resting({});
  double largest_error_n = 0;
  Vec3 before_m;
  for (int tick = 0; tick < 4000; ++tick) {
    const Vec3 position_m{0, 0, 0.008 * std::sin(2 * std::numbers::pi * 0.5 * tick * kPeriod_s)};
    motion.hand_m = position_m - before_m;
    motion.velocity_m_per_s = (1 / kPeriod_s) * motion.hand_m;
    motion.external_n_in_world = -400 * position_m;
    before_m = position_m;
    const Vec3 force_n = chain.apply({}, parameters, kPeriod_s, motion).force_n_in_world;
    largest_error_n = std::max(largest_error_n, norm(force_n - motion.external_n_in_world));
  }
  EXPECT_LT(largest_error_n, kRounding);
}

TEST(ExternalForce, LeavesThePassivityControlOfTheLawsAlone) {
  // The same hand at the same law with and without an external force that works on it.
  const SafetyParameters parameters = allowing(1, 5);
  SafetyChain with;
  SafetyChain without;
  SafetyChain::Motion motion = resting({});
  motion.stiffness_n_per_m = 500;
  motion.device_damping_n_s_per_m = 0.05;
  for (int tick = 0; tick < 3000; ++tick) {
    const double angle = 2 * std::numbers::pi * 2 * tick * kPeriod_s;
    const Vec3 force_n{0, 0, 1 - std::cos(angle)};
    motion.hand_m = {0, 0, -force_n.z / 500 - (tick > 0 ? -0.002 * (1 - std::cos(angle - 0.0125664)) : 0)};
    motion.velocity_m_per_s = (1 / kPeriod_s) * motion.hand_m;
    motion.external_n_in_world = {0, 0, 0.5 * std::sin(angle)};
    const auto both = with.apply(force_n, parameters, kPeriod_s, motion);
    motion.external_n_in_world = {};
    const auto alone = without.apply(force_n, parameters, kPeriod_s, motion);
    ASSERT_NEAR(both.passive_n_in_world.z, alone.passive_n_in_world.z, 1e-9) << tick;
    ASSERT_NEAR(with.energy_j(), without.energy_j(), 1e-9) << tick;
  }
}

TEST(ExternalForce, EntersAndLeavesWithinTheSlewLimitTogetherWithTheLaw) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-6, 6);
  SafetyParameters parameters = allowing(3);
  parameters.max_slew_n_per_s = 500;
  SafetyChain chain;
  Vec3 before;
  for (int tick = 0; tick < 5000; ++tick) {
    const Vec3 law_n{any(random), any(random), any(random)};
    const Vec3 external_n{any(random), any(random), any(random)};
    const Vec3 now = chain.apply(law_n, parameters, kPeriod_s, resting(external_n)).force_n_in_world;
    ASSERT_LE(norm(now - before), 0.5 + kRounding);
    ASSERT_LE(norm(now), parameters.max_force_n + kRounding);
    before = now;
  }
  for (int tick = 0; tick < SafetyChain::kReleaseTicks; ++tick)
    before = chain.release(parameters, kPeriod_s).force_n_in_world;
  EXPECT_EQ(before, Vec3{});
}

}  // namespace
}  // namespace hapticd::test
