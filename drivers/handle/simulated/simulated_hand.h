// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/settings/settings.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

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

enum class HandScript { stroke, tap, lean, mixed };
constexpr auto wordsOf(HandScript) {
  return rt::words<HandScript>("stroke", "tap", "lean", "mixed");
}

/// The simulated handle and the hand that holds it. The hand moves towards the surface, strokes it, taps it
/// or leans on it with press_force_n, retreats, and repeats this.
struct SimulatedHandleSettings {
  HandScript script = HandScript::stroke;
  double mass_kg = 0.045;
  double damping_n_s_per_m = 0.05;
  double friction_n = 0;  ///< of the handle, along each axis: kinetic friction and limit of static friction
  double position_quantum_m = 0;  ///< resolution of the measured position; 0: exact
  double hand_stiffness_n_per_m = 400;
  double hand_damping_n_s_per_m = 4;
  rt::Vec3 start_m_in_world{0, 0, -0.8};
  rt::Vec3 direction_in_world{0, 0, -1};  ///< of the approach; any length except zero
  double travel_m = 0.4;                  ///< distance after which the hand turns back
  double speed_m_per_s = 0.1;
  double press_force_n = 2;
  double press_s = 2;      ///< time for which it strokes or leans before it retreats
  double stroke_m = 0.05;  ///< amplitude of the stroke across the direction of approach
  double stroke_period_s = 2;
  bool follows_person = false;  ///< a person may lead the hand instead of the script
};

/// A handle (mass, viscous and dry friction) held by a hand (spring and damper) that follows a script. In
/// each round the hand moves from the start along the direction of approach until it feels a force, then
/// performs one of these actions, moves back to the start and begins again:
/// - stroke: it moves across for press_s while it keeps pressing;
/// - tap: it retreats at once and comes down again, kTaps times, with a loose grip;
/// - lean: with a firm grip it slowly builds up the press force, with a tremor, for press_s.
/// The script `mixed` performs them in turn: taps, stroke, lean. If there is no contact, the hand turns back
/// at the end of the travel.
///
/// Along the direction of approach the hand's aim is at most (target force) / (hand stiffness) ahead of the
/// handle and advances at most at the hand's speed. So it never pushes harder than the press force (with
/// tremor, kTremorShare more), yields to an approaching surface, and does not lunge where a surface vanishes.
/// Only behind its start does it stop yielding and push as hard as its spring does.
///
/// Each axis moves as a separate Motion, with its own dry friction; the hand's aim and the external force are
/// held over a step, as a device holds its force. The same calls always give the same motion.
///
/// A person can take the place of the script with lead(). The handle then moves with the hand's mass, drawn
/// to the person's target x_t by a spring k whose force is limited to kLead_n, and damped against the world.
/// While the target rests, such a hand is passive at its force port, whatever forces come: with the potential
/// V of the limited spring (k d^2 / 2 up to its limit, linear beyond), E = m v^2 / 2 + V(|x_t - x|) grows in
/// no step by more than the work (force) * (displacement). Proof: over a step that moves it by s, the spring
/// is held at the aim a = x_n + clamp(x_t - x_n) and does the work k c.s - k s^2 / 2 with c = a - x_n; Motion
/// is exact, so m v^2 / 2 grows by this work and that of the force, less what the damper takes. The gradient
/// of V is k c and changes by at most k per metre, so V falls by at least k c.s - k s^2 / 2. A target that
/// moves does the person's work. Thread: one at a time.  RT: safe.
class SimulatedHand {
 public:
  enum class Phase { approaching, pressing, retreating };

  /// Fraction of the target force, minus dry friction, at which the hand counts as pressing, because it
  /// approaches the full force asymptotically.
  static constexpr double kPressedShare = 0.95;
  /// More than any handle exerts; larger forces are clamped.
  static constexpr double kStrongestForceN = 1000;
  static constexpr int kTaps = 4;
  static constexpr double kTap_s = 0.06;   ///< duration of contact
  static constexpr double kLift_m = 0.02;  ///< height between two taps
  /// Relative to the press force: force at which a lean begins, and amplitude of its tremor.
  static constexpr double kFirstTouchShare = 0.2;
  static constexpr double kTremorShare = 0.05;
  static constexpr double kTremor_hz = 9;  ///< physiological tremor is 8 to 12 Hz
  /// Relative to the hand's stiffness: stiffness while tapping and while leaning; the damping scales with the
  /// square root.
  static constexpr double kLooseGrip = 0.5;
  static constexpr double kFirmGrip = 2;

  static constexpr double kHandMass_kg = 0.1;            ///< of the hand of a person who leads it
  static constexpr double kLeadStiffness_n_per_m = 200;  ///< critically damped
  static constexpr double kLead_n = 8;                   ///< the most that a person pushes with
  /// Without a new target for that long, the target rests where the hand is, so that it does not push.
  static constexpr double kLeadSilence_s = 0.2;
  /// Without one for that long, the script goes on: the hand moves back to the start.
  static constexpr double kScriptAgain_s = 30;

  static constexpr double kForearm_m = 0.3;
  static constexpr double kOpen_rad = 0.5;

  /// `step_s`: length of all steps, above zero. The direction of approach must not be zero; the mass must be
  /// above zero; friction, damping and stiffness must not be negative.
  SimulatedHand(const SimulatedHandleSettings& settings, double step_s);

  /// Simulates one step under `force_n_in_world`, the force that the handle exerts on the hand. A force that
  /// is not finite counts as zero.
  void step(const rt::Vec3& force_n_in_world);
  /// Sets the target to which a person leads the hand from now on. One that is not finite is ignored.
  void lead(const rt::Vec3& target_m_in_world);
  /// Whether a person leads it in place of the script.
  bool isLed() const { return is_led_; }

  rt::Vec3 position_m_in_world() const;
  rt::Vec3 velocity_m_per_s_in_world() const;
  /// How the tool is held, whose axis -z points ahead: the forearm turns about a point kForearm_m behind
  /// where the hand began. A unit quaternion that maps vectors of the tool to the world.
  rt::Quaternion orientation_in_world() const;
  /// Opening angle of a gripper in the hand, which closes it as it presses harder; 0..kOpen_rad.
  double gripper_rad() const { return kOpen_rad / (1 + norm(force_n_)); }
  Phase phase() const { return phase_; }
  /// Returns the action of this round; never `mixed`.
  HandScript action() const { return action_; }
  /// Returns how often the script has returned to its start.
  int rounds() const { return rounds_; }

 private:
  void beginRound();
  void aim(double force_n);
  double targetForce_n() const;
  void leave();
  void advanceAim();
  void stroke();
  void retreat();
  void follow();
  void letGo();
  void move(const rt::Vec3& force_n);
  double progress(const rt::Vec3& point_m) const {
    return dot(point_m - settings_.start_m_in_world, forward_);
  }

  SimulatedHandleSettings settings_;
  double step_s_;
  rt::Vec3 forward_;   // unit vector of the approach
  rt::Vec3 across_;    // unit vector of the stroke, perpendicular to forward_
  double friction_n_;  // friction along the approach
  DeviceAndHand system_;
  std::array<Motion, 3> axes_;  // x, y, z in the world
  rt::Vec3 aim_;                // target position of the hand
  rt::Vec3 aim_velocity_;       // of the free part of the aim; zero along the approach while it is held back
  rt::Vec3 force_n_;            // that the handle exerts
  rt::Vec3 turn_;               // end of the retreat
  HandScript action_ = HandScript::stroke;
  int taps_left_ = 0;
  Phase phase_ = Phase::approaching;
  double phase_time_s_ = 0;
  int rounds_ = 0;
  bool is_led_ = false;
  rt::Vec3 target_;       // of the person
  double silence_s_ = 0;  // since it was set
};

}  // namespace hapticd::drivers
