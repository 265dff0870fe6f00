#include "drivers/handle/simulated/simulated_hand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace hapticd::drivers {
namespace {

using config::SimulatedHandleSettings;
using rt::Vec3;
using Phase = SimulatedHand::Phase;

constexpr double kStepS = 0.001;
constexpr double kWallStiffness = 500;  // N/m
constexpr double kWallAt = 0.1;         // m from the start, along the approach

/// How far the hand has come along the approach of the default settings, -z.
double progress(const SimulatedHand& hand, const SimulatedHandleSettings& settings = {}) {
  return settings.start_m_in_world.z - hand.position_m_in_world().z;
}

/// A spring wall across the approach; a device with that wall pushes back along +z.
Vec3 wallForce(const SimulatedHand& hand, double wall_at = kWallAt) {
  return {0, 0, kWallStiffness * std::max(0.0, progress(hand) - wall_at)};
}

/// Position at `t_s` of a mass drawn by spring and damper towards a point that leaves it at constant speed:
/// m x'' + (b + b_h) x' + k x = k v t + b_h v, x(0) = x'(0) = 0, underdamped.
double closedForm(const SimulatedHandleSettings& s, double t_s) {
  const double decay = (s.damping_n_s_per_m + s.hand_damping_n_s_per_m) / (2 * s.mass_kg);
  const double rate = std::sqrt(s.hand_stiffness_n_per_m / s.mass_kg - decay * decay);
  const double lag = s.damping_n_s_per_m * s.speed_m_per_s / s.hand_stiffness_n_per_m;
  const double swing =
      lag * std::cos(rate * t_s) + (decay * lag - s.speed_m_per_s) / rate * std::sin(rate * t_s);
  return s.speed_m_per_s * t_s - lag + std::exp(-decay * t_s) * swing;
}

double freePosition(const SimulatedHandleSettings& settings, double t_s, double dt_s) {
  SimulatedHand hand(settings);
  for (int step = 0; step < std::lround(t_s / dt_s); ++step) hand.step(dt_s, {});
  return progress(hand, settings);
}

TEST(SimulatedHand, MovesFreelyLikeTheClosedFormOfADampedMassOnASpring) {
  SimulatedHandleSettings settings;
  settings.damping_n_s_per_m = 0.5;
  double worst_first_order = 0;
  double worst_remainder = 0;
  for (double t_s = 0.002; t_s < 0.3; t_s += 0.002) {
    const double exact = closedForm(settings, t_s);
    const double coarse = freePosition(settings, t_s, kStepS);
    const double fine = freePosition(settings, t_s, kStepS / 2);
    worst_first_order = std::max(worst_first_order, std::abs(coarse - exact));
    worst_remainder = std::max(worst_remainder, std::abs(2 * fine - coarse - exact));
  }
  // A method of first order errs by about w dt / 2 of the swing (speed / w), w = sqrt(k/m) = 94/s; twice that
  // is allowed. Extrapolated to no step at all, an error of the next order in w dt remains.
  const double w = std::sqrt(settings.hand_stiffness_n_per_m / settings.mass_kg);
  const double first_order = w * kStepS * settings.speed_m_per_s / w;
  EXPECT_LT(worst_first_order, first_order);
  EXPECT_LT(worst_remainder, w * kStepS * first_order);
}

TEST(SimulatedHand, PressesOnAWallWithThePressForce) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  double peak_n = 0;
  double settled_low_n = 1e9;
  double settled_high_n = 0;
  int pressing_steps = 0;
  while (hand.rounds() == 0) {
    const Vec3 force = wallForce(hand);
    hand.step(kStepS, force);
    peak_n = std::max(peak_n, force.z);
    if (hand.phase() != Phase::pressing) continue;
    if (++pressing_steps < 500) continue;  // decays with (b + b_h) / 2m = 45/s: exp(-22) is left
    settled_low_n = std::min(settled_low_n, force.z);
    settled_high_n = std::max(settled_high_n, force.z);
  }
  EXPECT_NEAR(settled_low_n, settings.press_force_n, 1e-6);
  EXPECT_NEAR(settled_high_n, settings.press_force_n, 1e-6);
  // Work of the largest push P = press force + b_h * speed over the way p into the wall, and the energy of
  // the approach: K p^2 / 2 <= P p + m v^2 / 2.
  const double push = settings.press_force_n + settings.hand_damping_n_s_per_m * settings.speed_m_per_s;
  const double v2 = settings.speed_m_per_s * settings.speed_m_per_s;
  EXPECT_LE(peak_n, push + std::sqrt(push * push + kWallStiffness * settings.mass_kg * v2));
}

TEST(SimulatedHand, IsStableOnAWallThatAnswersTwoMillisecondsLate) {
  SimulatedHand hand({});
  Vec3 late[2];
  double low_n = 1e9;
  double high_n = 0;
  int pressing_steps = 0;
  while (hand.rounds() == 0) {
    const Vec3 felt = late[0];
    late[0] = late[1];
    late[1] = wallForce(hand);
    hand.step(kStepS, felt);
    if (hand.phase() != Phase::pressing) continue;
    if (++pressing_steps < 1000) continue;
    low_n = std::min(low_n, felt.z);
    high_n = std::max(high_n, felt.z);
  }
  EXPECT_NEAR(low_n, 2, 1e-6);
  EXPECT_NEAR(high_n, 2, 1e-6);
}

TEST(SimulatedHand, StrokesAcrossWhileItPresses) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  double left = 0;
  double right = 0;
  double along_y = 0;
  while (hand.rounds() == 0) {
    hand.step(kStepS, wallForce(hand));
    left = std::min(left, hand.position_m_in_world().x);
    right = std::max(right, hand.position_m_in_world().x);
    along_y = std::max(along_y, std::abs(hand.position_m_in_world().y));
  }
  // The hand follows its aim with gain 1/sqrt((1 - r^2)^2 + ...) within r^2 = (pi / 94)^2 = 0.1 %.
  EXPECT_NEAR(right, settings.stroke_m, 0.002 * settings.stroke_m);
  EXPECT_NEAR(left, -settings.stroke_m, 0.002 * settings.stroke_m);
  EXPECT_EQ(along_y, 0);
}

TEST(SimulatedHand, RetreatsToTheStartAndBeginsAgain) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  int presses = 0;
  Phase before = hand.phase();
  for (int step = 0; hand.rounds() < 3 && step < 60'000; ++step) {
    hand.step(kStepS, wallForce(hand));
    presses += hand.phase() == Phase::pressing && before != Phase::pressing;
    if (hand.phase() == Phase::approaching && before == Phase::retreating) {
      // Behind its aim by at most the swing of the retreat, speed / sqrt(k/m).
      EXPECT_LT(norm(hand.position_m_in_world() - settings.start_m_in_world), 0.1 / 94);
    }
    before = hand.phase();
  }
  EXPECT_EQ(hand.rounds(), 3);
  EXPECT_EQ(presses, 3);
}

TEST(SimulatedHand, TurnsBackAtTheEndOfItsTravelWhereNothingIs) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  double farthest = 0;
  bool pressed = false;
  while (hand.rounds() < 2) {
    hand.step(kStepS, {});
    farthest = std::max(farthest, progress(hand));
    pressed |= hand.phase() == Phase::pressing;
  }
  EXPECT_FALSE(pressed);
  EXPECT_NEAR(farthest, settings.travel_m, 0.1 / 94);  // the swing of the turn
}

TEST(SimulatedHand, YieldsToAWallThatComesNearer) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  double wall = kWallAt;
  double settled_high_n = 0;
  int pressing_steps = 0;
  while (hand.phase() != Phase::retreating) {
    const Vec3 force = wallForce(hand, wall);
    hand.step(kStepS, force);
    if (hand.phase() != Phase::pressing) continue;
    wall -= 0.02 * kStepS;  // 2 cm/s towards the hand
    if (++pressing_steps > 500) settled_high_n = std::max(settled_high_n, force.z);
  }
  // The press force, the dampers at that speed, and the spring over the way of one step, since the hand aims
  // from where the handle was at the step's begin.
  const double expected_n =
      settings.press_force_n + (settings.hand_damping_n_s_per_m + settings.damping_n_s_per_m +
                                settings.hand_stiffness_n_per_m * kStepS) *
                                   0.02;
  EXPECT_NEAR(settled_high_n, expected_n, 1e-6);
}

TEST(SimulatedHand, DoesNotLungeWhenTheSurfaceVanishes) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings);
  while (hand.phase() != Phase::pressing) hand.step(kStepS, wallForce(hand));
  for (int step = 0; step < 500; ++step) hand.step(kStepS, wallForce(hand));
  const double at_loss = progress(hand);
  const double ahead = settings.press_force_n / settings.hand_stiffness_n_per_m;
  for (int step = 1; step <= 500; ++step) {
    hand.step(kStepS, {});
    // The stretched spring relaxes, with a swing as large again at most; the aim moves at its speed.
    ASSERT_LT(progress(hand) - at_loss, 2 * ahead + settings.speed_m_per_s * kStepS * step);
  }
}

TEST(SimulatedHand, StaysFiniteAndNearUnderExtremeForces) {
  constexpr double kHuge = std::numeric_limits<double>::max();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 forces[] = {
      {kHuge, -kHuge, kHuge}, {kInfinity, 0, 0}, {0, kNan, 0}, {0, 0, -kHuge}, {5e-324, 0, 0}};
  const SimulatedHandleSettings settings;
  for (const Vec3& force : forces) {
    SimulatedHand hand(settings);
    double farthest = 0;
    for (int step = 0; step < 20'000; ++step) {
      hand.step(kStepS, step % 3 == 0 ? -force : force);
      ASSERT_TRUE(isFinite(hand.position_m_in_world()) && isFinite(hand.velocity_m_per_s_in_world()));
      farthest = std::max(farthest, norm(hand.position_m_in_world() - settings.start_m_in_world));
    }
    // The strongest force, on three axes, stretches the hand's spring by F sqrt(3) / k; alternating, it
    // swings at most as far again.
    EXPECT_LT(farthest, settings.travel_m + 2 * std::sqrt(3) * SimulatedHand::kStrongestForceN /
                                                settings.hand_stiffness_n_per_m);
  }
}

TEST(SimulatedHand, IsStableForStiffLightAndHeavilyDampedHands) {
  for (const double mass : {1e-4, 0.045, 10.0}) {
    for (const double stiffness : {1.0, 1e6}) {
      for (const double damping : {0.0, 1e4}) {
        SimulatedHandleSettings settings;
        settings.mass_kg = mass;
        settings.hand_stiffness_n_per_m = stiffness;
        settings.hand_damping_n_s_per_m = damping;
        settings.damping_n_s_per_m = 0;
        SimulatedHand hand(settings);
        for (int step = 0; step < 10'000; ++step) {
          hand.step(kStepS, {});
          ASSERT_LT(std::abs(progress(hand)), 2 * settings.travel_m)
              << mass << " " << stiffness << " " << damping;
        }
      }
    }
  }
}

TEST(SimulatedHand, ApproachesAlongAnyDirection) {
  for (const Vec3& direction : {Vec3{0, -2, 0}, Vec3{1, 1, 1}, Vec3{-3, 0, 0}}) {
    SimulatedHandleSettings settings;
    settings.direction_in_world = direction;
    SimulatedHand hand(settings);
    for (int step = 0; step < 1000; ++step) hand.step(kStepS, {});
    const Vec3 way = hand.position_m_in_world() - settings.start_m_in_world;
    EXPECT_NEAR(dot(way, direction), norm(way) * norm(direction), 1e-12);
    EXPECT_NEAR(norm(way), settings.speed_m_per_s * 1.0, 0.1 / 94);
  }
}

}  // namespace
}  // namespace hapticd::drivers
