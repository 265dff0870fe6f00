// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/settings.h"
#include "drivers/handle/simulated/device_and_hand.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// A handle (mass, viscous and dry friction) in a hand (spring and damper) that follows a script. In each
/// round the hand moves from the start along the direction of approach until it feels a force, then does one
/// of:
/// - stroke: it strokes across for press_s while it keeps pressing;
/// - tap: it lets go at once and comes down again, kTaps times, with a loose grip;
/// - lean: in a firm grip it builds up the press force slowly, and trembles, for press_s;
/// moves back to the start, and begins again. The script `mixed` does one after the other: taps, stroke,
/// lean. Where it meets nothing it turns back at the end of the travel.
///
/// Along the direction of approach the hand aims at most (force it wants) / (its stiffness) ahead of the
/// handle, and advances its aim at most at its speed: so it never pushes harder than the press force (a
/// trembling hand kTremorShare more), yields to a surface that comes nearer, and does not lunge where one
/// vanishes. Only behind its start it yields no more and pushes as hard as its spring does.
///
/// Each axis moves as a Motion of its own, with dry friction along each; hand's aim and the force from
/// outside are held over a step, as a device holds its force. The same calls always give the same motion.
/// Thread: one at a time.  RT: safe.
class SimulatedHand {
 public:
  enum class Phase { approaching, pressing, retreating };

  /// Share of the wanted force, less what dry friction takes of it, at which the hand believes that it
  /// presses: it comes up to the full force ever more slowly.
  static constexpr double kPressedShare = 0.95;
  /// No handle is stronger; forces beyond are cut.
  static constexpr double kStrongestForceN = 1000;
  static constexpr int kTaps = 4;
  static constexpr double kTap_s = 0.06;   ///< of contact
  static constexpr double kLift_m = 0.02;  ///< between two taps
  /// Of the press force: what a leaning hand begins with, and how much it trembles.
  static constexpr double kFirstTouchShare = 0.2;
  static constexpr double kTremorShare = 0.05;
  static constexpr double kTremor_hz = 9;  ///< physiological tremor: 8 to 12 Hz
  /// Of the hand's stiffness, when it taps and when it leans; its damping goes with the root.
  static constexpr double kLooseGrip = 0.5;
  static constexpr double kFirmGrip = 2;

  /// `step_s`: of all steps, above zero. The direction of approach is not zero; the mass is above zero;
  /// friction, damping and stiffness are not negative.
  SimulatedHand(const config::SimulatedHandleSettings& settings, double step_s);

  /// Moves on by a step under `force_n_in_world`, the force that the handle exerts on the hand. A force that
  /// is not finite counts as zero.
  void step(const rt::Vec3& force_n_in_world);

  rt::Vec3 position_m_in_world() const;
  rt::Vec3 velocity_m_per_s_in_world() const;
  Phase phase() const { return phase_; }
  /// What it does in this round; never `mixed`.
  config::HandScript touch() const { return touch_; }
  /// How often the script has come back to its start.
  int rounds() const { return rounds_; }

 private:
  void beginRound();
  void aim(double felt_n);
  double wantedForce_n() const;
  void leave();
  void advanceAim();
  void stroke();
  void retreat();
  void move(const rt::Vec3& force_n);
  double progress(const rt::Vec3& point_m) const {
    return dot(point_m - settings_.start_m_in_world, forward_);
  }

  config::SimulatedHandleSettings settings_;
  double step_s_;
  rt::Vec3 forward_;   // unit vector of the approach
  rt::Vec3 across_;    // unit vector of the stroke, at right angles to it
  double friction_n_;  // that the hand works against along the approach
  DeviceAndHand system_;
  std::array<Motion, 3> axes_;  // x, y, z in the world
  rt::Vec3 aim_;                // where the hand wants the handle
  rt::Vec3 aim_velocity_;       // of the free part of the aim; zero along the approach while it is held back
  rt::Vec3 turn_;               // where the retreat ends
  config::HandScript touch_ = config::HandScript::stroke;
  int taps_left_ = 0;
  Phase phase_ = Phase::approaching;
  double phase_time_s_ = 0;
  int rounds_ = 0;
};

}  // namespace hapticd::drivers
