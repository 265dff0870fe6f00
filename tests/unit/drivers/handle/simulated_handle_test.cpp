// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <vector>

#include "drivers/driver_table.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "rt/base/clock.h"
#include "tests/unit/drivers/frame_collector.h"

namespace hapticd::drivers {
namespace {

TEST(Motion, FollowsTheClosedFormOfAFreeDampedOscillation) {
  const DeviceAndHand system{.mass_kg = 0.045,
                             .damping_n_s_per_m = 0.05,
                             .hand_stiffness_n_per_m = 400,
                             .hand_damping_n_s_per_m = 4,
                             .hand_mass_kg = 0.1};
  const double decay_per_s = 4.05 / (2 * 0.145);
  const double turn_per_s = std::sqrt(400 / 0.145 - decay_per_s * decay_per_s);
  const double target_m = -0.002;
  Motion motion(system, 0.001, 20);
  motion.place(target_m + 0.005, 0);
  for (int tick = 1; tick <= 500; ++tick) {
    motion.advance(0, 0, target_m);
    const double time_s = 0.001 * tick;
    const double expected_m = target_m + 0.005 * std::exp(-decay_per_s * time_s) *
                                             (std::cos(turn_per_s * time_s) +
                                              decay_per_s / turn_per_s * std::sin(turn_per_s * time_s));
    // 10000 exact steps of numbers below 0.01: rounding only
    ASSERT_NEAR(motion.position_m(), expected_m, 1e-12) << tick;
  }
}

TEST(Motion, StopsByCoulombFrictionAfterMassTimesSpeedSquaredByTwiceTheFriction) {
  const double mass_kg = 0.045, speed_m_per_s = 0.1, friction_n = 0.26;
  Motion motion({.mass_kg = mass_kg, .damping_n_s_per_m = 0, .coulomb_friction_n = friction_n}, 0.001, 20);
  motion.place(0, speed_m_per_s);
  const double stop_s = mass_kg * speed_m_per_s / friction_n;  // 17.3 ms
  int ticks = 0;
  while (motion.velocity_m_per_s() != 0 && ticks < 100) {
    motion.advance(0, 0, 0);
    ++ticks;
  }
  EXPECT_EQ(ticks, static_cast<int>(std::ceil(stop_s / 0.001)));
  // the deceleration is constant, so a stop within a sub-step is exact as well
  EXPECT_NEAR(motion.position_m(), mass_kg * speed_m_per_s * speed_m_per_s / (2 * friction_n), 1e-12);
}

TEST(Motion, OfASpringWithCoulombFrictionLosesTwiceFrictionByStiffnessPerHalfSwing) {
  const double stiffness_n_per_m = 400, friction_n = 0.26;
  Motion motion({.mass_kg = 0.045,
                 .damping_n_s_per_m = 0,
                 .coulomb_friction_n = friction_n,
                 .hand_stiffness_n_per_m = stiffness_n_per_m},
                0.001, 20);
  motion.place(0.01, 0);
  // 10 mm minus 1.3 mm per half oscillation, alternating sides: 8.7, ..., 0.9 mm on the far side, where 0.36
  // N still overcome friction; from there it moves 0.5 mm nearer, to 0.4 mm on the far side, where 0.16 N do
  // not
  for (int tick = 0; tick < 1000; ++tick) motion.advance(0, 0, 0);
  EXPECT_EQ(motion.velocity_m_per_s(), 0);
  // eight stops, each off by less than (change of the acceleration of 36 N/kg within 50 us) * (50 us)^2
  EXPECT_NEAR(motion.position_m(), 0.01 - 8 * 2 * friction_n / stiffness_n_per_m, 1e-7);
}

using rt::Vec3;
using Phase = SimulatedHand::Phase;

constexpr double kStepS = 0.001;
constexpr double kWallStiffness = 500;  // N/m
constexpr double kWallAt = 0.1;         // m from the start, along the approach

/// Returns the displacement of the hand along the approach of the default settings, -z.
double progress(const SimulatedHand& hand, const SimulatedHandleSettings& settings = {}) {
  return settings.start_m_in_world.z - hand.position_m_in_world().z;
}

/// A spring wall across the approach; it pushes back along +z.
Vec3 wallForce(const SimulatedHand& hand, double wall_at = kWallAt) {
  return {0, 0, kWallStiffness * std::max(0.0, progress(hand) - wall_at)};
}

/// Returns the position at `t_s` of a mass pulled by spring and damper towards a point that moves away at
/// constant speed: m x'' + (b + b_h) x' + k x = k v t + b_h v, x(0) = x'(0) = 0, underdamped.
double closedForm(const SimulatedHandleSettings& s, double t_s) {
  const double decay = (s.damping_n_s_per_m + s.hand_damping_n_s_per_m) / (2 * s.mass_kg);
  const double rate = std::sqrt(s.hand_stiffness_n_per_m / s.mass_kg - decay * decay);
  const double lag = s.damping_n_s_per_m * s.speed_m_per_s / s.hand_stiffness_n_per_m;
  const double swing =
      lag * std::cos(rate * t_s) + (decay * lag - s.speed_m_per_s) / rate * std::sin(rate * t_s);
  return s.speed_m_per_s * t_s - lag + std::exp(-decay * t_s) * swing;
}

double freePosition(const SimulatedHandleSettings& settings, double t_s, double dt_s) {
  SimulatedHand hand(settings, dt_s);
  for (int step = 0; step < std::lround(t_s / dt_s); ++step) hand.step({});
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
  // The aim is held over a step, which shifts it by up to the displacement of a step. Extrapolated to a step
  // of zero, an error of the next order in w dt remains, w = sqrt(k/m) = 94/s.
  const double w = std::sqrt(settings.hand_stiffness_n_per_m / settings.mass_kg);
  const double first_order = kStepS * settings.speed_m_per_s;
  EXPECT_LT(worst_first_order, first_order);
  EXPECT_LT(worst_remainder, w * kStepS * first_order);
}

TEST(SimulatedHand, PressesOnAWallWithThePressForce) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings, kStepS);
  double peak_n = 0;
  double settled_low_n = 1e9;
  double settled_high_n = 0;
  int pressing_steps = 0;
  while (hand.rounds() == 0) {
    const Vec3 force = wallForce(hand);
    hand.step(force);
    peak_n = std::max(peak_n, force.z);
    if (hand.phase() != Phase::pressing) continue;
    if (++pressing_steps < 500) continue;  // decays with (b + b_h) / 2m = 45/s: exp(-22) is left
    settled_low_n = std::min(settled_low_n, force.z);
    settled_high_n = std::max(settled_high_n, force.z);
  }
  EXPECT_NEAR(settled_low_n, settings.press_force_n, 1e-6);
  EXPECT_NEAR(settled_high_n, settings.press_force_n, 1e-6);
  // The work of the largest push P = press force + b_h * speed over the displacement p into the wall, plus
  // the energy of the approach: K p^2 / 2 <= P p + m v^2 / 2.
  const double push = settings.press_force_n + settings.hand_damping_n_s_per_m * settings.speed_m_per_s;
  const double v2 = settings.speed_m_per_s * settings.speed_m_per_s;
  EXPECT_LE(peak_n, push + std::sqrt(push * push + kWallStiffness * settings.mass_kg * v2));
}

TEST(SimulatedHand, StrokesAcrossWhileItPresses) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings, kStepS);
  double left = 0;
  double right = 0;
  double along_y = 0;
  while (hand.rounds() == 0) {
    hand.step(wallForce(hand));
    left = std::min(left, hand.position_m_in_world().x);
    right = std::max(right, hand.position_m_in_world().x);
    along_y = std::max(along_y, std::abs(hand.position_m_in_world().y));
  }
  // The hand follows its aim with gain 1/sqrt((1 - r^2)^2 + ...) within r^2 = (pi / 94)^2 = 0.1 %.
  EXPECT_NEAR(right, settings.stroke_m, 0.002 * settings.stroke_m);
  EXPECT_NEAR(left, -settings.stroke_m, 0.002 * settings.stroke_m);
  EXPECT_EQ(along_y, 0);
}

TEST(SimulatedHand, RetreatsToTheStartAndRepeats) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings, kStepS);
  int presses = 0;
  Phase before = hand.phase();
  for (int step = 0; hand.rounds() < 3 && step < 60'000; ++step) {
    hand.step(wallForce(hand));
    presses += hand.phase() == Phase::pressing && before != Phase::pressing;
    if (hand.phase() == Phase::approaching && before == Phase::retreating) {
      // Behind its aim by at most the oscillation of the retreat, speed / sqrt(k/m).
      EXPECT_LT(norm(hand.position_m_in_world() - settings.start_m_in_world), 0.1 / 94);
    }
    before = hand.phase();
  }
  EXPECT_EQ(hand.rounds(), 3);
  EXPECT_EQ(presses, 3);
}

TEST(SimulatedHand, TurnsBackAtTheEndOfItsTravelWhereNothingIs) {
  const SimulatedHandleSettings settings;
  SimulatedHand hand(settings, kStepS);
  double farthest = 0;
  bool pressed = false;
  while (hand.rounds() < 2) {
    hand.step({});
    farthest = std::max(farthest, progress(hand));
    pressed |= hand.phase() == Phase::pressing;
  }
  EXPECT_FALSE(pressed);
  EXPECT_NEAR(farthest, settings.travel_m, 0.1 / 94);  // the oscillation of the turn
}

TEST(SimulatedHand, TurnsBackHoweverTheEndOfItsTravelIsRounded) {
  for (int start_mm = -2000; start_mm <= 0; start_mm += 20) {
    for (const double speed_m_per_s : {0.1, 0.137, 0.3}) {
      SimulatedHandleSettings settings;
      settings.start_m_in_world = {0.1, -0.2, start_mm * 1e-3};
      settings.direction_in_world = {0.1 * (start_mm % 7), 0.3, -1};
      settings.travel_m = 0.1;
      settings.speed_m_per_s = speed_m_per_s;
      SimulatedHand hand(settings, kStepS);
      // back and forth, and as long again because the handle lags behind
      const double enough_s = 4 * settings.travel_m / settings.speed_m_per_s;
      for (double time_s = 0; time_s < enough_s && hand.rounds() == 0; time_s += kStepS) hand.step({});
      EXPECT_EQ(hand.rounds(), 1) << start_mm << " mm, " << speed_m_per_s << " m/s";
    }
  }
}

/// Duration in s and largest force in N of each contact with the wall, until `rounds` are over.
struct Contact {
  double seconds = 0;
  double peak_n = 0;
  double start_s = 0;
  HandScript touch = HandScript::mixed;
};
std::vector<Contact> contactsOf(const SimulatedHandleSettings& settings, int rounds) {
  std::vector<Contact> contacts;
  SimulatedHand hand(settings, kStepS);
  bool touching = false;
  for (int step = 0; hand.rounds() < rounds && step < 120'000; ++step) {
    const Vec3 force = wallForce(hand);
    if (force.z > 0 && !touching) contacts.push_back({0, 0, step * kStepS, hand.action()});
    touching = force.z > 0;
    if (touching) {
      contacts.back().seconds += kStepS;
      contacts.back().peak_n = std::max(contacts.back().peak_n, force.z);
    }
    hand.step(force);
  }
  EXPECT_EQ(hand.rounds(), rounds);
  return contacts;
}

TEST(SimulatedHand, TapsBrieflyAndReturnsToItsStartAfterFourTaps) {
  SimulatedHandleSettings settings;
  settings.script = HandScript::tap;
  const auto contacts = contactsOf(settings, 2);
  ASSERT_EQ(contacts.size(), 2U * SimulatedHand::kTaps);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    // the tap itself; at 0.1 m/s into the wall, by 2 N / 500 N/m, and out of it, with the spring of the loose
    // grip stretched by 2 N / 200 N/m to either side: 10 and 20 mm at most
    EXPECT_GT(contacts[i].seconds, SimulatedHand::kTap_s);
    EXPECT_LT(contacts[i].seconds, SimulatedHand::kTap_s + 0.3);
    EXPECT_GE(contacts[i].peak_n, SimulatedHand::kPressedShare * settings.press_force_n);
    if (i % SimulatedHand::kTaps == 0) continue;
    // lifted by 20 mm and back at 0.1 m/s: 0.4 s, plus the previous contact
    EXPECT_LT(contacts[i].start_s - contacts[i - 1].start_s, 0.4 + contacts[i - 1].seconds);
  }
  // from the start, 100 mm away, a second in each direction
  EXPECT_GT(contacts[4].start_s - contacts[3].start_s, 1.5);
}

TEST(SimulatedHand, LeansSlowlyUpToThePressForceAndTrembles) {
  SimulatedHandleSettings settings;
  settings.script = HandScript::lean;
  SimulatedHand hand(settings, kStepS);
  while (hand.phase() != Phase::pressing) hand.step(wallForce(hand));
  std::vector<double> forces_n;
  while (hand.phase() == Phase::pressing) {
    forces_n.push_back(wallForce(hand).z);
    hand.step({0, 0, forces_n.back()});
  }
  ASSERT_NEAR(static_cast<double>(forces_n.size()), settings.press_s / kStepS, 2);
  const auto mean = [&](double from_s, double to_s) {
    const auto first = forces_n.begin() + std::lround(from_s / kStepS);
    const auto last = forces_n.begin() + std::lround(to_s / kStepS);
    return std::accumulate(first, last, 0.0) / static_cast<double>(last - first);
  };
  // 2 N after a second, linearly; the handle lags by damping / wall stiffness, 11 ms, and over 1/9 s the
  // tremor averages out except for its growth
  EXPECT_NEAR(mean(0.5 - 1 / 18.0, 0.5 + 1 / 18.0), 0.5 * settings.press_force_n, 0.05);
  EXPECT_NEAR(mean(1.5, 1.5 + 3 / 9.0), settings.press_force_n, 0.005);
  const auto [low, high] = std::minmax_element(forces_n.begin() + 1500, forces_n.end() - 1);
  // the tremor drives the mass on the wall's spring and the dampers of the firm grip; the hand's aim is held
  // for a step of 1 / 111 of a period: 2 %
  const double omega = 2 * std::numbers::pi * SimulatedHand::kTremor_hz;
  const double damping = settings.damping_n_s_per_m + std::sqrt(2.0) * settings.hand_damping_n_s_per_m;
  const double gain =
      1 / std::hypot(1 - settings.mass_kg * omega * omega / kWallStiffness, omega * damping / kWallStiffness);
  const double expected_n = 2 * gain * SimulatedHand::kTremorShare * settings.press_force_n;
  EXPECT_NEAR(*high - *low, expected_n, 0.02 * expected_n);
}

TEST(SimulatedHand, MixesTapsStrokesAndLeans) {
  SimulatedHandleSettings settings;
  settings.script = HandScript::mixed;
  settings.press_s = 1;
  std::vector<HandScript> touches;
  for (const Contact& contact : contactsOf(settings, 6)) touches.push_back(contact.touch);
  using enum HandScript;
  const std::vector<HandScript> expected{tap, tap, tap, tap, stroke, lean, tap, tap, tap, tap, stroke, lean};
  EXPECT_EQ(touches, expected);
}

TEST(SimulatedHand, WithDryFrictionStopsWhereItsSpringPullsLessThanFriction) {
  SimulatedHandleSettings settings;
  settings.friction_n = 0.2;
  SimulatedHand hand(settings, kStepS);
  for (int step = 0; step < 500; ++step) hand.step({});
  // steady motion: the spring pulls friction and the device's own damping along behind the aim
  const double lag_m = (settings.friction_n + settings.damping_n_s_per_m * settings.speed_m_per_s) /
                       settings.hand_stiffness_n_per_m;
  // half a step's displacement, because the aim is held over a step
  EXPECT_NEAR(progress(hand), settings.speed_m_per_s * 0.5 - lag_m, settings.speed_m_per_s * kStepS);
  EXPECT_EQ(hand.velocity_m_per_s_in_world().x, 0);
}

TEST(SimulatedHand, WithoutPressForceStrokesWhereItIsAndRepeats) {
  SimulatedHandleSettings settings;
  settings.press_force_n = 0;
  SimulatedHand hand(settings, kStepS);
  double farthest = 0;
  for (double time_s = 0; time_s < settings.press_s + 1; time_s += kStepS) {
    hand.step({});
    farthest = std::max(farthest, progress(hand));
  }
  EXPECT_GE(hand.rounds(), 1);
  EXPECT_LT(farthest, 1e-9);  // rounding, step by step
}

TEST(SimulatedHand, WithDryFrictionDetectsThatItPresses) {
  for (const double friction_n : {0.05, 0.3, 1.0, 5.0}) {  // with the last one it cannot move the handle
    for (const Vec3& direction : {Vec3{0, 0, -1}, Vec3{0.6, 0.6, -1}}) {
      SimulatedHandleSettings settings;
      settings.friction_n = friction_n;
      settings.direction_in_world = direction;
      SimulatedHand hand(settings, kStepS);
      // back and forth at its speed, and the time of pressing: less than 8 s
      for (int step = 0; step < 8000 && hand.rounds() == 0; ++step) hand.step(wallForce(hand));
      EXPECT_EQ(hand.rounds(), 1) << friction_n << " N along z " << direction.z << ", x " << direction.x;
    }
  }
}

TEST(SimulatedHandle, PublishesMeasurementsInOrderThatMoveAlongTheApproach) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  EXPECT_EQ(handle.status().state, HandlePresence::absent);
  ASSERT_TRUE(handle.start(*channels));
  EXPECT_EQ(handle.status().state, HandlePresence::present);
  std::uint64_t sequence = 0;
  std::int64_t time_ns = 0;
  double z = -0.8;
  int measurements = 0;
  ASSERT_TRUE(test::eventually([&] {
    if (!channels->state.refresh()) return false;
    const rt::HandleState& state = channels->state.front();
    EXPECT_GT(state.sequence, sequence);
    EXPECT_GE(state.time_ns, time_ns);
    EXPECT_LE(state.position_m_in_world.z, z);  // the first 4 s of the script
    sequence = state.sequence;
    time_ns = state.time_ns;
    z = state.position_m_in_world.z;
    return ++measurements >= 100;
  }));
  handle.stop();
  EXPECT_EQ(handle.status().state, HandlePresence::absent);
  EXPECT_LT(z, -0.8);
}

TEST(SimulatedHandle, ExertsTheNewestCommandAndNothingAfterStop) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  ASSERT_TRUE(handle.start(*channels));
  std::uint64_t tick = 0;
  const auto commandUntil = [&](std::uint64_t session, auto condition) {
    return test::eventually([&] {
      channels->command.write({{0, 3, 4}, ++tick, session, rt::monotonicNow_ns()});
      return condition();
    });
  };
  EXPECT_TRUE(commandUntil(1, [&] { return handle.exertedForceN() == 5; }));
  EXPECT_TRUE(handle.status().last_hop);
  EXPECT_TRUE(test::eventually([&] { return handle.exertedForceN() == 0; })) << "commands have stopped";
  EXPECT_TRUE(commandUntil(1, [&] { return handle.exertedForceN() == 5; }));
  EXPECT_TRUE(commandUntil(2, [&] { return handle.exertedForceN() == 0; })) << "of another session";
  EXPECT_TRUE(commandUntil(1, [&] {
    channels->state.refresh();
    return handle.exertedForceN() == 5 && channels->state.front().command_latency_ns > 0;
  }));
  handle.stop();
  EXPECT_EQ(handle.exertedForceN(), 0);
  channels->state.refresh();
  EXPECT_FALSE(channels->state.refresh()) << "nothing is published after stop()";
}

TEST(SimulatedHandle, StopsStartsAndStopsAgain) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandle handle({});
  handle.stop();
  ASSERT_TRUE(handle.start(*channels));
  EXPECT_FALSE(handle.start(*channels)) << "it is running";
  handle.stop();
  handle.stop();
  ASSERT_TRUE(handle.start(*channels));
}

TEST(SimulatedHandle, DoesNotStartWithSettingsThatDescribeNoHand) {
  const auto channels = std::make_unique<HandleChannels>();
  SimulatedHandleSettings no_direction;
  no_direction.direction_in_world = {};
  EXPECT_FALSE(SimulatedHandle(no_direction).start(*channels));
  SimulatedHandleSettings no_mass;
  no_mass.mass_kg = 0;
  EXPECT_FALSE(SimulatedHandle(no_mass).start(*channels));
}

TEST(MakeHandle, MakesTheDriverThatTheSettingsName) {
  EXPECT_NE(dynamic_cast<SimulatedHandle*>(makeHandle({}, {}).get()), nullptr);
}

}  // namespace
}  // namespace hapticd::drivers
