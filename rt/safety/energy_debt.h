// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace hapticd::rt {

/// Decides when the hand has got so much more energy than it gave that the force must end.
///
/// The debt begins at zero whenever the force begins anew from zero: what happened before, or what the hand
/// did while it met no force, is no sign of an unstable loop.  Thread: one.  RT: safe.
class EnergyDebt {
 public:
  /// The smallest debt that ends the force: below it the account is not exact enough.
  static constexpr double kMin_j = 0.005;
  /// After a debt the force may act again when it has been zero for this long.
  static constexpr double kPause_s = 1;

  /// To be called at each tick with the energy that the hand gave less what it got, the largest debt that a
  /// contact at the limits explains, and whether the force is zero and was not to be exerted in the last
  /// tick. Returns whether the force must be zero.
  bool follow(double energy_j, double allowed_j, bool at_zero, double period_s) noexcept {
    if (at_zero) {
      start_j_ = std::min(energy_j, 0.0);
      zero_s_ += period_s;
      if (zero_s_ > kPause_s) exceeded_ = false;
    } else {
      zero_s_ = 0;
      if (start_j_ - energy_j > allowed_j) exceeded_ = true;
    }
    return exceeded_;
  }

 private:
  double start_j_ = 0;  ///< balance when the force was zero last; a surplus counts
  bool exceeded_ = false;
  double zero_s_ = 0;
};

}  // namespace hapticd::rt
