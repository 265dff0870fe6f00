// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numbers>

#include "rt/words.h"

/// What keeps the loop of device, hand and delay stable: damping while in contact, and a limit of the
/// stiffness. Both follow from the loop's lag: the age, in the mean, of the position that the force that acts
/// now answers.
namespace hapticd::rt {

/// Of what a lag makes a spring give too much (K times the lag) the damping in contact is that multiple. The
/// bare limit is 1; above 1 the loop is stable by a margin, above 2 the delayed damping itself costs
/// stability.
inline constexpr double kContactDamping = 1.75;

/// Of m / lag^2: the stiffest spring whose delayed damping a mass m bears. The loop of a mass, spring and
/// damper with that lag, m s^2 + (K + B s) e^(-s lag) = 0 with B = 1.75 K lag, is at its limit at 0.55.
inline constexpr double kStiffnessOfMass = 0.35;

/// Of m / lag: the most damping that a delayed loop with the mass m bears, all of it together. A damper alone
/// is at its limit at pi / 2.
inline constexpr double kDampingOfMass = 0.7;

/// What limits the stiffness.
enum class StiffnessRule : std::uint8_t {
  none,   ///< nothing: k_s is within the limit
  delay,  ///< the damping of the device in the hand against the lag (largestStableStiffness_n_per_m)
  mass,   ///< the device's mass against the damping that comes late (stiffnessOfMass_n_per_m)
};
constexpr auto wordsOf(StiffnessRule) {
  return words<StiffnessRule>("none", "delay", "mass");
}

/// Seconds that the force lags behind the hand: half a period in the mean, because it is held for a period,
/// the handle's delay, and the delay of a first-order low-pass on the force at low frequencies, 1 / (2 pi f).
/// `period_s`: > 0; `delay_s`: below 0 counts as 0; `filter_hz`: 0: there is no low-pass.  RT: safe.
constexpr double loopLag_s(double period_s, double delay_s, double filter_hz) noexcept {
  const double filter_s = filter_hz > 0 ? 1 / (2 * std::numbers::pi * filter_hz) : 0;
  return period_s / 2 + std::max(0.0, delay_s) + filter_s;
}

/// The stiffest spring that a sampled, delayed loop renders stably, N/m:  (b + B) / lag  (Gil et al., Hulin;
/// a linear device of damping b, small B). An eigenvalue sweep over 45 to 100 g, b of 0.05 to 1 N s/m and up
/// to 5 ms finds 0.999 to 1.020 of it for B = 0, and 0.89 to 0.98 for B = 2 N s/m. `damping_n_s_per_m`: b, of
/// the device in the hand, > 0; `wall_damping_n_s_per_m`: B, >= 0; `lag_s`: > 0. RT: safe.
constexpr double largestStableStiffness_n_per_m(double damping_n_s_per_m, double wall_damping_n_s_per_m,
                                                double lag_s) noexcept {
  return (damping_n_s_per_m + wall_damping_n_s_per_m) / lag_s;
}

/// The damping in contact that keeps a spring stable on a device without any damping of its own, N s/m.
/// RT: safe.
constexpr double contactDamping_n_s_per_m(double stiffness_n_per_m, double lag_s) noexcept {
  return kContactDamping * stiffness_n_per_m * lag_s;
}

/// The stiffest spring that stays stable with contactDamping_n_s_per_m() that comes as late as the spring,
/// N/m. `mass_kg`: of the device alone, > 0: a hand that holds it adds to it.  RT: safe.
constexpr double stiffnessOfMass_n_per_m(double mass_kg, double lag_s) noexcept {
  return kStiffnessOfMass * mass_kg / (lag_s * lag_s);
}

/// The most damping at the hand, of whatever origin, that may come as late as that, N s/m.  RT: safe.
constexpr double largestDamping_n_s_per_m(double mass_kg, double lag_s) noexcept {
  return kDampingOfMass * mass_kg / lag_s;
}

}  // namespace hapticd::rt
