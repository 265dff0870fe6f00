// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/command_history.h"
#include "rt/low_pass.h"
#include "rt/parameters.h"
#include "rt/passivity.h"
#include "rt/realtime_safe.h"
#include "rt/thermal_limit.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// The way of every force from the law to the device, after the scene blend. The order is fixed: passivity
/// control, low-pass, slew limit, magnitude clamp (peak and thermal), finite check.
///
/// Whatever comes in, what goes out is finite, no longer than the magnitude limit and differs from the output
/// before by no more than the slew limit allows; a release ends in zero after kReleaseTicks equal steps,
/// which may be larger. A force over a lowered magnitude limit shrinks at the slew rate until it is within.
/// Thread: one.  Progress: wait-free.  RT: safe.
class SafetyChain {
 public:
  /// Where the handle is not to be trusted any more, the force is zero after that many ticks.
  static constexpr int kReleaseTicks = 3;

  /// What the hand and the scene did since the tick before; as below where it is not known.
  struct Motion {
    Vec3 hand_m;                   ///< of the hand, world axes
    Vec3 velocity_m_per_s;         ///< of the hand
    double surface_work_j = 0;     ///< as of Passivity::Input
    double stiffness_n_per_m = 0;  ///< at the hand; 0: nothing is stored
    double device_damping_n_s_per_m = 0;
    double max_surface_speed_m_per_s = 0;
    double delay_s = 0;                  ///< from a motion of the hand to the force that answers it
    double max_damping_n_s_per_m = 1e9;  ///< at the hand: the most that may come that late
    bool known = false;                  ///< the hand's motion was measured
  };

  struct Output {
    Vec3 passive_n_in_world;   ///< after passivity control
    Vec3 filtered_n_in_world;  ///< after the low-pass
    Vec3 slewed_n_in_world;    ///< after the slew limit
    Vec3 force_n_in_world;     ///< after clamp and finite check
    bool slew_limited = false;
    bool magnitude_clamped = false;
    bool not_finite = false;  ///< the input was not; zero was aimed at instead
    bool passivity_acted = false;
    bool thermally_limited = false;  ///< less than the largest force is allowed
  };

  /// `period_s`: since the call before, > 0.
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s,
               const Motion& motion) HAPTICD_RT;
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s) HAPTICD_RT {
    return apply(force_n_in_world, parameters, period_s, {});
  }

  /// Instead of apply(): one of kReleaseTicks equal steps to zero. It begins at the force of the first call
  /// after an apply(). The stages before the slew limit have zero.
  Output release(const SafetyParameters& parameters, double period_s) HAPTICD_RT;

  /// What was returned last; zero at first.
  const Vec3& lastForce_n_in_world() const noexcept { return last_; }
  double energy_j() const noexcept { return passivity_.energy_j(); }

 private:
  void exert(const Vec3& force_n, const SafetyParameters& parameters, double period_s) HAPTICD_RT;

  Passivity passivity_;
  LowPass low_pass_;
  ThermalLimit thermal_;
  CommandHistory commands_;
  Vec3 last_;
  Vec3 release_step_;
  int release_ticks_left_ = 0;
  bool releasing_ = false;
};

}  // namespace hapticd::rt
