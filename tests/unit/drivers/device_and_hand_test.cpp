// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/simulated/device_and_hand.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace hapticd::drivers
