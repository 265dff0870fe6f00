// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/rt/fixtures/fixture_rig.h"

namespace hapticd::test {

/// Period of the ticks in which devices and hands are simulated.
inline constexpr double kHandTick_s = 0.001;

/// One direction of a connection. Packets arrive late, not at all, or after newer ones, which then count.
class Connection {
 public:
  Connection(double delay_s, double jitter_s, double loss)
      : delay_s_(delay_s), jitter_s_(jitter_s), loss_(loss) {}

  struct Packet {
    int number = -1;
    rt::Vec3 first;
    rt::Vec3 second;
  };

  void send(int tick, const rt::Vec3& first, const rt::Vec3& second, RandomShapes& random) {
    const double delay_s = delay_s_ + random.between(0, 1) * jitter_s_;
    if (random.between(0, 1) < loss_) return;
    flying_.push_back(
        {tick + static_cast<int>(std::ceil(delay_s / kHandTick_s - 1e-9)), {tick, first, second}});
  }
  const Packet& received(int tick) {
    std::erase_if(flying_, [&](const Flying& flying) {
      if (flying.arrives > tick) return false;
      if (flying.packet.number > newest_.number) newest_ = flying.packet;
      return true;
    });
    return newest_;
  }
  /// Whole ticks, as the other side counts them.
  double longestDelay_s() const {
    return std::ceil((delay_s_ + jitter_s_) / kHandTick_s - 1e-9) * kHandTick_s;
  }

 private:
  struct Flying {
    int arrives;
    Packet packet;
  };
  double delay_s_;
  double jitter_s_;
  double loss_;
  std::vector<Flying> flying_;
  Packet newest_;
};

/// A device in a hand: a mass on a spring to where the hand wants to be, or without a spring pushed by 0.8 N.
/// It damps with 0.5 N s/m at least, 60 N/m do so too, and stiffer hands in proportion. Heavier ones damp as
/// much as makes them rest within two seconds by themselves: along a wall nothing else does.
struct Hand {
  double mass_kg;
  double stiffness_n_per_m;
  rt::Vec3 anchor_m{};
  rt::Vec3 push_n{};
  rt::Vec3 place_m{};
  rt::Vec3 velocity_m_per_s{};

  double damping_n_s_per_m() const { return std::max({0.5, stiffness_n_per_m / 120, 8 * mass_kg}); }
  double energy_j() const {
    const rt::Vec3 off = place_m - anchor_m;
    return 0.5 * mass_kg * dot(velocity_m_per_s, velocity_m_per_s) + 0.5 * stiffness_n_per_m * dot(off, off) -
           dot(push_n, place_m);
  }
  void move(const rt::Vec3& force_n) {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      const rt::Vec3 total_n = force_n + push_n - stiffness_n_per_m * (place_m - anchor_m) -
                               damping_n_s_per_m() * velocity_m_per_s;
      velocity_m_per_s += (kHandTick_s / kSteps / mass_kg) * total_n;
      place_m += (kHandTick_s / kSteps) * velocity_m_per_s;
    }
  }
};

}  // namespace hapticd::test
