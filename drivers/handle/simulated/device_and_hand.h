// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace hapticd::drivers {

/// One axis of a haptic device held by a hand:
/// m x'' = force - b x' - friction - k_h (x - target) - b_h x'.
struct DeviceAndHand {
  double mass_kg = 0.045;             ///< of the device
  double damping_n_s_per_m = 0.05;    ///< b, of the device
  double coulomb_friction_n = 0;      ///< f_c, of the device: kinetic friction and limit of static friction
  double hand_stiffness_n_per_m = 0;  ///< k_h, between the device and the hand's target; 0: no hand
  double hand_damping_n_s_per_m = 0;  ///< b_h
  double hand_mass_kg = 0;            ///< m_h, moves with the device

  double inertia_kg() const noexcept { return mass_kg + hand_mass_kg; }
  double viscosity_n_s_per_m() const noexcept { return damping_n_s_per_m + hand_damping_n_s_per_m; }
};

/// Response of a linear system with one input over one step of fixed length during which the input is held:
/// (x, v) <- transition (x, v) + input * force. Exact.
struct HeldStep {
  std::array<double, 4> transition;  ///< row by row
  std::array<double, 2> input;       ///< per newton
};

/// Computes the step response of device and hand without Coulomb friction, with the hand's target at 0.
/// `step_s` > 0.
HeldStep heldStep(const DeviceAndHand& system, double step_s);

/// Simulates a device and hand under commanded forces that are held for a period. The motion is exact except
/// for the events of Coulomb friction; a stop within a sub-step is placed with second-order accuracy.
/// Thread: one.
class Motion {
 public:
  /// `period_s` > 0; `sub_steps` >= 1 per period.
  Motion(const DeviceAndHand& system, double period_s, int sub_steps);

  /// Replaces the system from the next period on; position and velocity are kept.
  /// Cost: a matrix exponential, microseconds.
  void become(const DeviceAndHand& system);

  /// Sets position and velocity.
  void place(double position_m, double velocity_m_per_s) noexcept {
    position_m_ = position_m;
    velocity_m_per_s_ = velocity_m_per_s;
  }
  /// Simulates one period with the force `held_n` and an additional external force `constant_n`, both held.
  void advance(double held_n, double constant_n, double hand_target_m) noexcept;

  double position_m() const noexcept { return position_m_; }
  double velocity_m_per_s() const noexcept { return velocity_m_per_s_; }

 private:
  void subStep(double force_n) noexcept;
  void leaveRest(double force_n, double duration_s) noexcept;

  DeviceAndHand system_;
  int sub_steps_;
  double sub_step_s_;
  HeldStep step_;
  double position_m_ = 0;
  double velocity_m_per_s_ = 0;
};

}  // namespace hapticd::drivers
