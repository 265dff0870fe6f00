// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/simulated/device_and_hand.h"

#include <Eigen/Core>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace hapticd::drivers {

HeldStep heldStep(const DeviceAndHand& system, double step_s) {
  // Treating the input as a third, constant state makes the exponential contain both matrices.
  Eigen::Matrix3d rates = Eigen::Matrix3d::Zero();
  rates(0, 1) = 1;
  rates(1, 0) = -system.hand_stiffness_n_per_m / system.inertia_kg();
  rates(1, 1) = -system.viscosity_n_s_per_m() / system.inertia_kg();
  rates(1, 2) = 1 / system.inertia_kg();
  const Eigen::Matrix3d step = (rates * step_s).exp();
  return {{step(0, 0), step(0, 1), step(1, 0), step(1, 1)}, {step(0, 2), step(1, 2)}};
}

Motion::Motion(const DeviceAndHand& system, double period_s, int sub_steps)
    : system_(system),
      sub_steps_(sub_steps),
      sub_step_s_(period_s / sub_steps),
      step_(heldStep(system, sub_step_s_)) {}

void Motion::become(const DeviceAndHand& system) {
  system_ = system;
  step_ = heldStep(system, sub_step_s_);
}

void Motion::advance(double held_n, double constant_n, double hand_target_m) noexcept {
  const double force_n = held_n + constant_n + system_.hand_stiffness_n_per_m * hand_target_m;
  for (int i = 0; i < sub_steps_; ++i) subStep(force_n);
}

void Motion::subStep(double force_n) noexcept {
  const double friction_n = system_.coulomb_friction_n;
  if (velocity_m_per_s_ == 0 && friction_n > 0) {
    leaveRest(force_n, sub_step_s_);
    return;
  }
  const double sliding_n = velocity_m_per_s_ == 0 ? 0 : std::copysign(friction_n, velocity_m_per_s_);
  const auto& [transition, input] = step_;
  const double position_m =
      transition[0] * position_m_ + transition[1] * velocity_m_per_s_ + input[0] * (force_n - sliding_n);
  const double velocity_m_per_s =
      transition[2] * position_m_ + transition[3] * velocity_m_per_s_ + input[1] * (force_n - sliding_n);
  if (friction_n == 0 || velocity_m_per_s * velocity_m_per_s_ > 0) {
    position_m_ = position_m;
    velocity_m_per_s_ = velocity_m_per_s;
    return;
  }
  // it came to rest within the step, with nearly constant deceleration
  const double moving_s = sub_step_s_ * velocity_m_per_s_ / (velocity_m_per_s_ - velocity_m_per_s);
  position_m_ += velocity_m_per_s_ * moving_s / 2;
  velocity_m_per_s_ = 0;
  leaveRest(force_n, sub_step_s_ - moving_s);
}

/// Starts from rest, for the short time `duration_s`: stays while friction holds it, otherwise moves with
/// constant acceleration.
void Motion::leaveRest(double force_n, double duration_s) noexcept {
  const double pull_n = force_n - system_.hand_stiffness_n_per_m * position_m_;
  if (std::abs(pull_n) <= system_.coulomb_friction_n) return;
  const double acceleration =
      (pull_n - std::copysign(system_.coulomb_friction_n, pull_n)) / system_.inertia_kg();
  velocity_m_per_s_ = acceleration * duration_s;
  position_m_ += acceleration * duration_s * duration_s / 2;
}

}  // namespace hapticd::drivers
