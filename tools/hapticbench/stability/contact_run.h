// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "drivers/handle/simulated/device_and_hand.h"
#include "tools/hapticbench/stability/wall.h"
#include "tools/lib/parts/is.h"

namespace hapticd::tools {

using drivers::DeviceAndHand;

inline constexpr double kTick_s = 0.001;

/// A device in a hand in front of a wall. The wall sees the quantised position and the backward difference of
/// it as velocity, or what the drivers make of it; its force reaches the device `delay_ticks` later and is
/// then held for a tick.
struct Rig {
  DeviceAndHand system;
  double quantum_m = 0;  ///< of the measured position; 0: none
  int delay_ticks = 0;   ///< after the law, 0..100
  int sub_steps = 20;
  bool driver_velocity = false;  ///< by drivers::VelocityEstimator, with the shipped resolution
};

/// How contact begins and what holds the device against the wall.
struct Tap {
  double start_m = 0;          ///< h
  double speed_m_per_s = 0.1;  ///< inwards
  double hand_target_m = 0;    ///< h; without effect where no hand holds the device
  double constant_n = 0;       ///< outwards; negative: presses the device against the wall
};

/// The outcome of a tap.
struct ContactRun {
  bool stable = false;
  bool ran_away = false;          ///< left the 0.2 m around the wall, or a number was not finite
  double peak_to_peak_m = 0;      ///< over the last quarter
  double mean_m = 0;              ///< over the last quarter
  double seconds = 0;             ///< simulated
  double cycles_per_s = 0;        ///< over the last half
  double energy_per_cycle_j = 0;  ///< that the wall gave in the last half, per whole cycle; 0: no cycle
  double mean_power_w = 0;        ///< the same per time
  /// Largest energy that the acting force had given to device and hand at any time since the beginning.
  double most_given_j = 0;
  double most_above_potential_j = 0;  ///< the same beyond what its potential had fallen by
  double deepest_m = 0;               ///< h
};
auto fieldsOf(Is<ContactRun> auto& run) {
  auto& [stable, ran_away, swing, mean, seconds, rate, per_cycle, power, given, above, deepest] = run;
  return std::tie(stable, ran_away, swing, mean, seconds, rate, per_cycle, power, given, above, deepest);
}

/// Potential energy of the wall's force at h, joules.
using Potential = std::function<double(double h_m)>;

/// Stable: within 2 s the peak-to-peak motion of the last quarter is at rest or below half that of the second
/// quarter. At rest: below 0.1 mm or, where the position is quantised, below three steps, within which no
/// reading is more than one step beside the middle one. Unstable: it is above 1.5 times. Between the two the
/// run is extended up to the time in which a loop that has only 1 % of its damping left would halve its
/// motion (32 s at most); then it is stable if the motion fell by 5 %. `potential_j`: for
/// most_above_potential_j; may be empty.
ContactRun runContact(Wall& wall, const Rig& rig, const Tap& tap, const Potential& potential_j = {});

/// Runs for `seconds`, without deciding about stability.
ContactRun runContactFor(Wall& wall, const Rig& rig, const Tap& tap, double seconds);

/// Returns the largest minus the smallest of the values [first, last).
double peakToPeak(const std::vector<double>& values, std::size_t first, std::size_t last);

}  // namespace hapticd::tools
