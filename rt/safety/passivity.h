// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Passivity observer and controller in impedance causality (Hannaford and Ryu, "Time-domain passivity
/// control of haptic interfaces", 2002), extended to an energy balance of two ports.
///
/// The balance W is the energy that the hand has given to the box and not got back:  W -= F . dx  each tick,
/// where dx is the hand's displacement and F the force that acted meanwhile, which was commanded one handle
/// delay ago. The second port is the scene: when a frame moves a surface, the energy of the spring to it
/// changes at once, and the surface has done that work. A rising surface may therefore lift the hand: its
/// work is credited, no faster than |F| v_surface_max; what a sinking surface takes back is debited at once.
/// Beyond that, the box must never give more than it got: while W < 0 the motion of the hand is damped, so
/// that the excess is taken back within the tick as far as the largest damping allows. Where no force is
/// requested nothing is done, so that there is no force in free space.
///
/// A sampled spring of stiffness K gives K |dx|^2 / 2 too much each tick; the part dissipated by the device's
/// own damping b, b |dx|^2 / T, is credited. Where b > K T / 2 (Colgate) the controller therefore does
/// nothing, and it does not rely on damping by the hand.
///
/// A credit never exceeds a few times the energy of a spring under the largest force that acts or is on its
/// way to the hand, and it vanishes with that force: energy dissipated by friction cannot be given back
/// later. A debt is kept as long as the device may still be moving with the excess energy: beyond the end of
/// a contact and through faults, whatever caused it. It decays only while the hand is observed to rest,
/// because then the energy is gone.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class Passivity {
 public:
  /// Input of one tick; all vectors in world axes, at the hand.
  struct Input {
    Vec3 force_n;              ///< force to be exerted next; finite
    Vec3 acted_n;              ///< force that acted during the last tick
    Vec3 motion_m;             ///< displacement of the hand during the last tick
    Vec3 velocity_m_per_s;     ///< velocity of the hand now
    double surface_work_j;     ///< energy stored in the spring by a change of the scene; 0 without a change
    double stiffness_n_per_m;  ///< 0: no contact, or the motion is unknown
    double device_damping_n_s_per_m;  ///< b
    double max_surface_speed_m_per_s;
    double period_s;
    double largest_n = 0;  ///< largest force that acts or is on its way to the hand
    /// Limit from the loop's lag, in addition to that of the controller itself.
    double max_damping_n_s_per_m = 1e9;
    bool motion_known = true;  ///< `motion_m` was measured
    double motion_s = 0;  ///< time that `motion_m` took; a device slower than the loop: more than a period
    double stored_j = 0;  ///< energy known to be in the springs of fixtures, in addition to those of the law
  };
  /// Result of one tick.
  struct Output {
    Vec3 force_n;
    bool acted = false;
  };

  /// Updates the energy balance and returns the force, damped if the balance is negative.
  Output apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT;

  /// Returns W in joules.
  double energy_j() const noexcept { return energy_j_; }

 private:
  void updateBalance(const Input& input) HAPTICD_RT;
  void limitCredit(const Input& input) HAPTICD_RT;
  void fadeAtRest(const Input& input) HAPTICD_RT;

  double energy_j_ = 0;
  double credit_j_ = 0;   ///< work of the surface that may still be given to the hand
  Vec3 since_rest_m_;     ///< displacement since the hand last came to rest
  double resting_s_ = 0;  ///< time for which it has rested since then
};

/// Decides when the hand has got so much more energy than it gave that the force must end.
///
/// The debt begins at zero whenever the force begins anew from zero: what happened before, or what the hand
/// did while it met no force, is no sign of an unstable loop. A loop that is in debt again soon is unstable,
/// and would be for ever.  Thread: one.  RT: safe.
class EnergyDebt {
 public:
  /// The smallest debt that ends the force: below it the account is not exact enough.
  static constexpr double kMin_j = 0.005;
  /// After a debt the force may act again when it has been zero for this long ...
  static constexpr double kPause_s = 1;
  /// ... but after a second one within this time only when a person asks for it.
  static constexpr double kAgain_s = 60;

  /// To be called at each tick with the energy that the hand gave less what it got, the largest debt that a
  /// contact at the limits explains, whether the force is zero and was not to be exerted in the last
  /// tick, and the newest request of a person. Returns whether the force must be zero.
  bool follow(double energy_j, double allowed_j, bool at_zero, std::uint64_t request,
              double period_s) noexcept {
    since_last_s_ += period_s;
    if (std::exchange(request_, request) != request) {
      since_last_s_ = kAgain_s;
      lasts_ = false;
    }
    if (at_zero) {
      start_j_ = std::min(energy_j, 0.0);
      zero_s_ += period_s;
      if (zero_s_ > kPause_s && !lasts_) exceeded_ = false;
    } else {
      zero_s_ = 0;
      if (!exceeded_ && start_j_ - energy_j > allowed_j) {
        exceeded_ = true;
        lasts_ = since_last_s_ < kAgain_s;
        since_last_s_ = 0;
      }
    }
    return exceeded_;
  }

 private:
  double start_j_ = 0;  ///< balance when the force was zero last; a surplus counts
  bool exceeded_ = false;
  bool lasts_ = false;  ///< until a person asks
  double zero_s_ = 0;
  double since_last_s_ = kAgain_s;  ///< time since the last debt
  std::uint64_t request_ = 0;
};

}  // namespace hapticd::rt
