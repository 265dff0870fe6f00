// SPDX-License-Identifier: Apache-2.0
#include "rt/safety/latency_probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/passive_hand.h"

// How late forces act, measured on devices in hands whose latency is known.
namespace hapticd::test {
namespace {

using rt::LatencyProbe;
using rt::Vec3;

/// Measures with a hand whose wish moves as `wish_m(seconds)` along the knock.
LatencyProbe::Result measure(Hand hand, double latency_s, double friction_n, const auto& wish_m) {
  LatencyProbe probe;
  probe.start();
  Connection forces(latency_s, 0, 0);
  RandomShapes random(1);
  double command_n = 0;
  for (int tick = 0; probe.isRunning(); ++tick) {
    const double encoder_m = 55e-6;
    command_n = probe.step({.position_m = encoder_m * std::round(hand.place_m.x / encoder_m),
                            .command_n = command_n,
                            .period_s = kHandTick_s});
    forces.send(tick, {command_n, 0, 0}, {}, random);
    hand.anchor_m.x = wish_m(tick * kHandTick_s);
    const double speed = norm(hand.velocity_m_per_s);
    const Vec3 drag = speed > 1e-4 ? (-friction_n / speed) * hand.velocity_m_per_s : Vec3{};
    hand.move(forces.received(tick).first + drag);
  }
  return probe.result();
}

TEST(LatencyProbe, FindsTheLatencyOfAnyHandWithinAMillisecondAndAHalf) {
  for (const double latency_s : {0.0, 0.001, 0.003, 0.007, 0.015, 0.03, 0.05}) {
    for (const double hand_n_per_m : {0.0, 60.0, 200.0, 400.0}) {
      for (const double mass_kg : {0.045, 0.1, 0.3}) {
        const LatencyProbe::Result result = measure({.mass_kg = mass_kg, .stiffness_n_per_m = hand_n_per_m},
                                                    latency_s, 0, [](double) { return 0.0; });
        ASSERT_TRUE(result.conclusive) << latency_s << " " << hand_n_per_m << " " << mass_kg;
        ASSERT_NEAR(result.latency_s, latency_s, 0.0015) << hand_n_per_m << " " << mass_kg;
        ASSERT_NEAR(result.mass_kg, mass_kg, 0.15 * mass_kg) << latency_s << " " << hand_n_per_m;
      }
    }
  }
}

TEST(LatencyProbe, IsNotMisledByAHandThatMoves) {
  for (const double hz : {0.5, 1.5, 3.0}) {
    for (const double amplitude_m : {0.01, 0.05}) {
      const auto result = measure({.mass_kg = 0.1, .stiffness_n_per_m = 60}, 0.01, 0.05, [&](double time_s) {
        return amplitude_m * std::sin(2 * M_PI * hz * time_s);
      });
      if (!result.conclusive) continue;
      EXPECT_NEAR(result.latency_s, 0.01, 0.003) << hz << " Hz, " << amplitude_m << " m";
    }
  }
}

// A device whose motors are off, or that somebody holds still; its position jitters by one count.
TEST(LatencyProbe, SaysNothingOfADeviceThatDoesNotMove) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::minstd_rand random(seed);
    LatencyProbe probe;
    probe.start();
    double command_n = 0;
    while (probe.isRunning()) {
      const double jitter_m = 55e-6 * static_cast<double>(random() % 2);
      command_n = probe.step({.position_m = jitter_m, .command_n = command_n, .period_s = kHandTick_s});
    }
    EXPECT_EQ(probe.result().number, 1U);
    EXPECT_FALSE(probe.result().conclusive)
        << seed << " explained " << probe.result().explained << ", mass " << probe.result().mass_kg;
  }
}

TEST(LatencyProbe, KnocksWithoutPushingTheHandAway) {
  LatencyProbe probe;
  probe.start();
  double impulse_n_s = 0;
  double moment = 0;
  double largest_n = 0;
  int knocked = 0;
  for (int tick = 0; probe.isRunning(); ++tick) {
    const double force_n = probe.step({.position_m = 0, .command_n = 0, .period_s = 0.001});
    impulse_n_s += 0.001 * force_n;
    moment += 0.001 * impulse_n_s;
    largest_n = std::max(largest_n, std::abs(force_n));
    if (force_n != 0) knocked = tick;
  }
  EXPECT_EQ(largest_n, LatencyProbe::kKnock_n);
  EXPECT_NEAR(impulse_n_s, 0, 1e-12);
  EXPECT_NEAR(moment, 0, 1e-12);
  EXPECT_LT(knocked, 160);
}

}  // namespace
}  // namespace hapticd::test
