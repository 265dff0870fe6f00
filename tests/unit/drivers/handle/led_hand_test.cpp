// SPDX-License-Identifier: Apache-2.0
// The simulated hand while a person leads it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "drivers/handle/simulated/simulated_hand.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "tests/unit/drivers/frame_collector.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

constexpr double kStepS = 0.001;
constexpr double kMassKg = 0.145;  // of the default handle, and of the hand
constexpr double kReachM = SimulatedHand::kLead_n / SimulatedHand::kLeadStiffness_n_per_m;
constexpr Vec3 kStart{0, 0, -0.8};

/// Energy of the mass, and of a spring whose force is limited.
double energyOf(const SimulatedHand& hand, const Vec3& target) {
  const double d = norm(target - hand.position_m_in_world());
  const double stretched = d < kReachM ? d * d / 2 : kReachM * kReachM / 2 + kReachM * (d - kReachM);
  const Vec3 v = hand.velocity_m_per_s_in_world();
  return kMassKg * dot(v, v) / 2 + SimulatedHand::kLeadStiffness_n_per_m * stretched;
}

/// Leads it on where it is led already, before the silence ends that.
void hold(SimulatedHand& hand, const Vec3& target, int steps, const Vec3& force_n = {}) {
  for (int step = 0; step < steps; ++step) {
    if (step % 50 == 0) hand.lead(target);
    hand.step(force_n);
  }
}

TEST(LedHand, IsPassiveUnderAnyForcesWhileItsTargetRests) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-1, 1);
  const auto anywhere = [&](double scale) {
    return Vec3{scale * even(random), scale * even(random), scale * even(random)};
  };
  SimulatedHand hand({}, kStepS);
  Vec3 target = kStart;
  for (int step = 0; step < 50'000; ++step) {
    // jumps from within its reach to far beyond it; what they do is the person's work
    if (step % 150 == 0) hand.lead(target = kStart + anywhere(step % 300 == 0 ? 0.02 : 0.3));
    const Vec3 before = hand.position_m_in_world();
    const double energy_j = energyOf(hand, target);
    // slow pushes and, for longer than the hand's period, the most hostile: along the motion
    const Vec3 v = hand.velocity_m_per_s_in_world();
    const Vec3 force_n =
        step % 2000 < 1000 ? anywhere(20) : (4 / std::max(norm(v), 1e-3)) * v + anywhere(0.1);
    hand.step(force_n);
    const double work_j = dot(force_n, hand.position_m_in_world() - before);
    ASSERT_LE(energyOf(hand, target) - energy_j, work_j + 1e-12) << "in step " << step;  // rounding
  }
}

TEST(LedHand, FollowsASmallStepOfItsTargetLikeACriticallyDampedMass) {
  SimulatedHand hand({}, kStepS);
  const Vec3 target = kStart + Vec3{0.01, -0.02, 0};
  const double omega = std::sqrt(SimulatedHand::kLeadStiffness_n_per_m / kMassKg);
  for (int step = 1; step <= 190; ++step) {
    if (step == 1) hand.lead(target);
    hand.step({});
    const double t_s = step * kStepS;
    const double left = (1 + omega * t_s) * std::exp(-omega * t_s);
    const Vec3 expected = target - left * (target - kStart);
    ASSERT_LT(norm(hand.position_m_in_world() - expected), 1e-9) << t_s;  // the steps are exact
  }
}

TEST(LedHand, StaysBehindItsTargetByTheForceAndPushesWithNoMoreThanAHandDoes) {
  SimulatedHand hand({}, kStepS);
  hold(hand, kStart, 2000, {0, 0, 2});
  EXPECT_NEAR(hand.position_m_in_world().z, kStart.z + 2 / SimulatedHand::kLeadStiffness_n_per_m, 1e-9);
  // however far the target is, a force just above the limit pushes it away, and one just below does not
  const Vec3 far = kStart - Vec3{0, 0, 2};
  hold(hand, far, 500, {0, 0, 1.01 * SimulatedHand::kLead_n});
  EXPECT_GT(hand.velocity_m_per_s_in_world().z, 0);
  hold(hand, far, 500, {0, 0, 0.99 * SimulatedHand::kLead_n});
  EXPECT_LT(hand.velocity_m_per_s_in_world().z, 0);
}

TEST(LedHand, ComesToRestOnTheStiffestWallThatTheConfigurationAllows) {
  // k_s of at most 5000 N/m without damping of its own, answered a period later; the hand's own damping of
  // 10.8 N s/m carries 5000 N/m times a lag of 1.5 ms, 7.5 N s/m
  constexpr double kWall_n_per_m = 5000;
  SimulatedHand hand({}, kStepS);
  double depth_m = 0;
  double older_m = 0;
  for (int step = 0; step < 3000; ++step) {
    if (step % 50 == 0) hand.lead(kStart - Vec3{0, 0, 0.05});
    hand.step({0, 0, kWall_n_per_m * std::exchange(older_m, depth_m)});
    depth_m = std::max(0.0, kStart.z - 0.02 - hand.position_m_in_world().z);
  }
  EXPECT_LT(norm(hand.velocity_m_per_s_in_world()), 1e-6);
  // spring against wall: 30 mm between target and wall
  const double expected_m =
      0.03 * SimulatedHand::kLeadStiffness_n_per_m / (kWall_n_per_m + SimulatedHand::kLeadStiffness_n_per_m);
  EXPECT_NEAR(depth_m, expected_m, 1e-6);
}

TEST(LedHand, RestsWhereItIsAfterSilence) {
  SimulatedHand hand({}, kStepS);
  hand.lead(kStart - Vec3{0, 0, 1});
  for (int step = 0; step < 199; ++step) hand.step({});
  EXPECT_LT(hand.velocity_m_per_s_in_world().z, -0.3) << "it is on its way";
  hand.step({});
  const Vec3 here = hand.position_m_in_world();
  for (int step = 0; step < 2000; ++step) hand.step({});
  // the target is that of the step in which the silence ended, which moved it by less than 1 mm
  EXPECT_LT(norm(hand.position_m_in_world() - here), 0.001);
  EXPECT_LT(norm(hand.velocity_m_per_s_in_world()), 1e-9);
  hold(hand, kStart, 2000);
  EXPECT_LT(norm(hand.position_m_in_world() - kStart), 1e-6) << "and follows again";
}

TEST(LedHand, GoesOnWithItsScriptLongAfterThePersonHasLetItGo) {
  SimulatedHand hand({}, kStepS);
  EXPECT_FALSE(hand.isLed());
  const Vec3 aside = kStart + Vec3{0.1, 0, 0.1};
  hold(hand, aside, 1000);
  const int kSteps = static_cast<int>(std::lround(SimulatedHand::kScriptAgain_s / kStepS));
  for (int step = 0; step < kSteps - 100; ++step) hand.step({});
  EXPECT_TRUE(hand.isLed());
  EXPECT_LT(norm(hand.position_m_in_world() - aside), 1e-6);
  for (int step = 0; step < 200; ++step) hand.step({});
  EXPECT_FALSE(hand.isLed());
  EXPECT_EQ(hand.phase(), SimulatedHand::Phase::retreating);
  // 0.14 m at 0.1 m/s to its start; then it approaches
  for (int step = 0; step < 5000 && hand.phase() == SimulatedHand::Phase::retreating; ++step) {
    hand.step({});
    ASSERT_LT(norm(hand.velocity_m_per_s_in_world()), 0.2) << "it does not lunge";
  }
  EXPECT_EQ(hand.phase(), SimulatedHand::Phase::approaching);
  EXPECT_LT(norm(hand.position_m_in_world() - kStart), 0.01);
}

TEST(LedHand, IgnoresATargetThatIsNoPlace) {
  SimulatedHand hand({}, kStepS);
  hand.lead({0, std::numeric_limits<double>::quiet_NaN(), 0});
  EXPECT_FALSE(hand.isLed());
  hold(hand, kStart, 100);
  hand.lead({std::numeric_limits<double>::infinity(), 0, 0});
  for (int step = 0; step < 100; ++step) hand.step({});
  EXPECT_LT(norm(hand.position_m_in_world() - kStart), 1e-9);
}

/// Where the handle is after it was led to `target` for a while.
Vec3 positionLedTo(const Vec3& target, bool follows) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({.travel_m = 0.001, .stroke_m = 0, .follows_person = follows});
  EXPECT_TRUE(handle.start(*channels));
  test::eventually([&] {
    channels->hand_target_m_in_world.write(target);
    channels->state.refresh();
    const rt::HandleState& state = channels->state.front();
    return state.sequence > 1000 || norm(state.position_m_in_world - target) < 0.001;
  });
  handle.stop();
  return channels->state.front().position_m_in_world;
}

TEST(SimulatedHandle, IsLedOnlyWhereItsSettingsAllowIt) {
  const Vec3 target = kStart + Vec3{0.05, 0.05, 0};
  EXPECT_LT(norm(positionLedTo(target, true) - target), 0.001);
  EXPECT_LT(norm(positionLedTo(target, false) - kStart), 0.01);
}

}  // namespace
}  // namespace hapticd::drivers
