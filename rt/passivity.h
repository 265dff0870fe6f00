// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Passivity observer and controller in impedance causality (Hannaford and Ryu, "Time-domain passivity
/// control of haptic interfaces", 2002), with a ledger of two ports.
///
/// The ledger W holds what the hand has given to the box and not got back:  W -= F . dx  each tick, with the
/// force F that acted while the hand moved by dx, which is the one commanded the handle's delay ago. What is
/// behind it, the scene, is the second port: where a frame moves a surface, the spring to it stores another
/// energy at once, and the surface has done that work. So a surface that rises may lift the hand: its work is
/// credited, no faster than |F| v_surface_max; what a surface takes back by sinking is taken at once. Of the
/// remainder the box must never give more than it got: while W < 0 the motion along the force is damped, so
/// that what was given too much is taken again within the tick, as far as the largest damping allows. Where
/// no force is wanted nothing is done, so that a hand that touches nothing feels nothing.
///
/// A sampled spring of stiffness K gives K |dx|^2 / 2 too much each tick; what the device's own damping b
/// takes of it, b |dx|^2 / T, is credited. So where b > K T / 2 (Colgate) nothing is done, and the damping of
/// the hand is not relied on.
///
/// A credit never exceeds a few times the energy of a spring under the largest force that acts or is on its
/// way to the hand, and is gone with that force: what friction has dissipated cannot be given back later. A
/// debt is kept as long as the device may still be moving with the energy that it was given: beyond the end
/// of a contact and through faults, whatever created it. It fades only while the hand is seen to rest,
/// because then the energy is gone.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class Passivity {
 public:
  struct Input {
    Vec3 force_n;                     ///< to be exerted next; finite
    Vec3 acted_n;                     ///< on the hand over the last tick
    Vec3 motion_m;                    ///< of the hand over the last tick
    Vec3 velocity_m_per_s;            ///< of the hand now
    double surface_work_j;            ///< stored by the spring because the scene changed; 0 without a change
    double stiffness_n_per_m;         ///< at the hand; 0: no contact, or the motion is not known
    double device_damping_n_s_per_m;  ///< b, at the hand
    double max_surface_speed_m_per_s;
    double period_s;
    double largest_n = 0;                ///< of the forces that act or are on their way to the hand
    double max_damping_n_s_per_m = 1e9;  ///< that the loop's lag allows, beside SafetyParameters'
    bool motion_known = true;            ///< `motion_m` was measured
  };
  struct Output {
    Vec3 force_n;
    bool acted = false;
  };

  Output apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT;

  /// W, joules.
  double energy_j() const noexcept { return energy_j_; }

 private:
  void book(const Input& input) HAPTICD_RT;
  void limitCredit(const Input& input) HAPTICD_RT;
  void fadeAtRest(const Input& input) HAPTICD_RT;

  double energy_j_ = 0;
  double credit_j_ = 0;   ///< work of the surface that may still be given to the hand
  Vec3 since_rest_m_;     ///< motion since the hand was last seen to begin a rest
  double resting_s_ = 0;  ///< for that long the hand has stayed there
};

}  // namespace hapticd::rt
