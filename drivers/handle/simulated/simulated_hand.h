#pragma once

#include "config/settings.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// A handle (mass and damping) in a hand (spring and damper) that follows a script: it moves from the start
/// along the direction of approach until it feels the press force, strokes across for press_s while it keeps
/// pressing, moves back to the start, and begins again; where it meets nothing it turns back at the end of
/// the travel.
///
/// Along the direction of approach the hand aims at most press_force / hand_stiffness ahead of the handle,
/// and advances its aim at most at its speed: so it never pushes harder than the press force, yields to a
/// surface that comes nearer, and does not lunge where one vanishes. Only behind its start it yields no more
/// and pushes as hard as its spring does.
///
/// The linear forces are integrated by implicit Euler, which is stable for every mass, stiffness and damping;
/// the force from outside is held over the step, as a device holds it. The same calls always give the same
/// motion.
/// Thread: one at a time.  RT: safe.
class SimulatedHand {
 public:
  enum class Phase { approaching, pressing, retreating };

  /// Share of the press force at which the hand believes that it presses: it comes up to the full force ever
  /// more slowly.
  static constexpr double kPressedShare = 0.95;
  /// No handle is stronger; forces beyond are cut.
  static constexpr double kStrongestForceN = 1000;

  /// The direction of approach is not zero; the mass is above zero; damping and stiffness are not negative.
  explicit SimulatedHand(const config::SimulatedHandleSettings& settings);

  /// Moves on by `dt_s` (above zero) under `force_n_in_world`, the force that the handle exerts on the hand.
  /// A force that is not finite counts as zero.
  void step(double dt_s, const rt::Vec3& force_n_in_world);

  const rt::Vec3& position_m_in_world() const { return position_; }
  const rt::Vec3& velocity_m_per_s_in_world() const { return velocity_; }
  Phase phase() const { return phase_; }
  /// How often the script has come back to its start.
  int rounds() const { return rounds_; }

 private:
  void aim(double dt_s, double felt_n);
  void advanceAim(double dt_s);
  void stroke(double dt_s);
  void retreat(double dt_s);
  void move(double dt_s, const rt::Vec3& force_n);
  double progress(const rt::Vec3& point_m) const {
    return dot(point_m - settings_.start_m_in_world, forward_);
  }

  config::SimulatedHandleSettings settings_;
  rt::Vec3 forward_;  // unit vector of the approach
  rt::Vec3 across_;   // unit vector of the stroke, at right angles to it
  rt::Vec3 position_;
  rt::Vec3 velocity_;
  rt::Vec3 aim_;           // where the hand wants the handle
  rt::Vec3 aim_velocity_;  // of the free part of the aim; zero along the approach while it is held back
  Phase phase_ = Phase::approaching;
  double phase_time_s_ = 0;
  int rounds_ = 0;
};

}  // namespace hapticd::drivers
