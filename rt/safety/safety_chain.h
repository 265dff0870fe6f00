// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/safety/command_history.h"
#include "rt/safety/energy_budget.h"
#include "rt/safety/force_limit.h"
#include "rt/safety/passivity.h"

namespace hapticd::rt {

/// Stages that every force passes from the law to the device, after the scene blend. Their order is fixed:
/// passivity control, low-pass, palpation cue and external force, slew limit, magnitude clamp (peak and
/// thermal), finite check.
///
/// An external force is kept out of the balance of passivity control, which knows what the springs of the box
/// store, and has an energy budget of its own.
///
/// For any input, the output is finite, no longer than the magnitude limit, and differs from the previous
/// output by no more than the slew limit allows. A release reaches zero in kReleaseTicks equal steps, which
/// may be larger. A force above a lowered magnitude limit shrinks at the slew rate until it is within the
/// limit.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class SafetyChain {
 public:
  /// Number of ticks after which a released force is zero.
  static constexpr int kReleaseTicks = 3;

  /// Motion of hand and scene since the previous tick; the defaults apply where it is unknown.
  struct Motion {
    Vec3 hand_m;                   ///< displacement of the hand, in world axes
    Vec3 velocity_m_per_s;         ///< velocity of the hand
    double surface_work_j = 0;     ///< see Passivity::Input
    double stiffness_n_per_m = 0;  ///< of the law at the hand; 0: it stores no energy
    double device_damping_n_s_per_m = 0;
    double max_surface_speed_m_per_s = 0;
    double delay_s = 0;                  ///< from a motion of the hand to the force that responds to it
    double max_damping_n_s_per_m = 1e9;  ///< at the hand; limit for damping with this delay
    bool known = false;                  ///< the hand's motion was measured
    double motion_s = 0;                 ///< see Passivity::Input
    Vec3 cue_n_in_world{};               ///< palpation cue, added after the low-pass
    Vec3 external_n_in_world{};          ///< external force at the hand, added there too
    double stored_j = 0;                 ///< see Passivity::Input
  };

  /// Forces after each stage, in newtons at the hand, and which stages acted.
  struct Output {
    Vec3 passive_n_in_world;   ///< after passivity control
    Vec3 filtered_n_in_world;  ///< after the low-pass
    Vec3 slewed_n_in_world;    ///< after the slew limit
    Vec3 force_n_in_world;     ///< after clamp and finite check
    bool slew_limited = false;
    bool magnitude_clamped = false;
    bool not_finite = false;  ///< the input was not finite; the aim is zero instead
    bool passivity_acted = false;
    bool thermally_limited = false;  ///< the allowed force is below the maximum
  };

  /// Passes a force through the stages. `period_s`: time since the previous call, > 0.
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s,
               const Motion& motion) HAPTICD_RT;
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s) HAPTICD_RT {
    return apply(force_n_in_world, parameters, period_s, {});
  }

  /// Called instead of apply() to reach zero in kReleaseTicks equal steps, starting from the last output of
  /// apply(). The stages before the slew limit receive zero.
  Output release(const SafetyParameters& parameters, double period_s) HAPTICD_RT;

  /// Called before apply() or release() where the device has exerted no force for a while, whatever was
  /// commanded last: the next output starts from zero.
  void restart() HAPTICD_RT;

  /// Returns the last output; initially zero.
  const Vec3& lastForce_n_in_world() const noexcept { return last_; }
  double energy_j() const noexcept { return passivity_.energy_j(); }

 private:
  /// Returns as much of the external force as its limits allow.
  Vec3 allowedExternal_n(const SafetyParameters& parameters, double period_s,
                         const Motion& motion) HAPTICD_RT;
  /// `own_n`: the part of the force that is not external.
  void command(const Vec3& force_n, const Vec3& own_n, const SafetyParameters& parameters,
               double period_s) HAPTICD_RT;

  Passivity passivity_;
  LowPass low_pass_;
  ThermalLimit thermal_;
  EnergyBudget external_budget_;
  CommandHistory commands_;           // without the external part
  CommandHistory external_commands_;  // the external part alone
  Vec3 last_;
  Vec3 last_own_;  // its part that is not external
  Vec3 release_step_;
  Vec3 own_release_step_;
  int release_ticks_left_ = 0;
  bool releasing_ = false;
};

}  // namespace hapticd::rt
