// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/simulated/simulated_hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <Eigen/Core>
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

namespace {

using rt::Vec3;

/// Rounding tolerance at the end of the travel. Coordinates of up to 15 m have rounding errors below 2e-15 m.
constexpr double kRounding_m = 1e-12;

Vec3 unit(const Vec3& a) {
  return (1 / norm(a)) * a;
}

/// Returns a unit vector perpendicular to `forward` and to the world's y axis, or to its x axis if `forward`
/// is along y.
Vec3 acrossOf(const Vec3& forward) {
  constexpr double kParallel = 0.9;
  const Vec3 reference = std::abs(forward.y) < kParallel ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  return unit(cross(forward, reference));
}

Vec3 limited(const Vec3& force_n) {
  if (!isFinite(force_n)) return {};
  const double largest = std::max({std::abs(force_n.x), std::abs(force_n.y), std::abs(force_n.z)});
  return largest > SimulatedHand::kStrongestForceN ? (SimulatedHand::kStrongestForceN / largest) * force_n
                                                   : force_n;
}

HandScript actionOf(HandScript script, int round) {
  if (script != HandScript::mixed) return script;
  constexpr std::array kInTurn{HandScript::tap, HandScript::stroke, HandScript::lean};
  return kInTurn[static_cast<std::size_t>(round) % kInTurn.size()];
}

double gripFor(HandScript action) {
  if (action == HandScript::tap) return SimulatedHand::kLooseGrip;
  return action == HandScript::lean ? SimulatedHand::kFirmGrip : 1;
}

DeviceAndHand systemOf(const SimulatedHandleSettings& settings, double grip) {
  return {.mass_kg = settings.mass_kg,
          .damping_n_s_per_m = settings.damping_n_s_per_m,
          .coulomb_friction_n = settings.friction_n,
          .hand_stiffness_n_per_m = grip * settings.hand_stiffness_n_per_m,
          .hand_damping_n_s_per_m = std::sqrt(grip) * settings.hand_damping_n_s_per_m};
}

/// Device and hand of a person who leads it, critically damped.
DeviceAndHand ledSystemOf(const SimulatedHandleSettings& settings) {
  DeviceAndHand system = systemOf(settings, 1);
  system.hand_mass_kg = SimulatedHand::kHandMass_kg;
  system.hand_stiffness_n_per_m = SimulatedHand::kLeadStiffness_n_per_m;
  const double critical = 2 * std::sqrt(system.hand_stiffness_n_per_m * system.inertia_kg());
  system.hand_damping_n_s_per_m = std::max(critical - system.damping_n_s_per_m, 0.0);
  return system;
}

Motion motionOf(const DeviceAndHand& system, double step_s, double position_m) {
  constexpr int kSubSteps = 4;  // 0.25 ms of resolution for stops by dry friction
  Motion motion(system, step_s, system.coulomb_friction_n > 0 ? kSubSteps : 1);
  motion.place(position_m, 0);
  return motion;
}

}  // namespace

SimulatedHand::SimulatedHand(const SimulatedHandleSettings& settings, double step_s)
    : settings_(settings),
      step_s_(step_s),
      forward_(unit(settings.direction_in_world)),
      across_(acrossOf(forward_)),
      friction_n_(settings.friction_n * (std::abs(forward_.x) + std::abs(forward_.y) + std::abs(forward_.z))),
      system_(systemOf(settings, 1)),
      axes_{motionOf(system_, step_s, settings.start_m_in_world.x),
            motionOf(system_, step_s, settings.start_m_in_world.y),
            motionOf(system_, step_s, settings.start_m_in_world.z)},
      aim_(settings.start_m_in_world) {
  beginRound();
}

Vec3 SimulatedHand::position_m_in_world() const {
  return {axes_[0].position_m(), axes_[1].position_m(), axes_[2].position_m()};
}

Vec3 SimulatedHand::velocity_m_per_s_in_world() const {
  return {axes_[0].velocity_m_per_s(), axes_[1].velocity_m_per_s(), axes_[2].velocity_m_per_s()};
}

rt::Quaternion SimulatedHand::orientation_in_world() const {
  const Vec3 pivot_m = settings_.start_m_in_world - kForearm_m * forward_;
  const Vec3 forearm_m = position_m_in_world() - pivot_m;
  // at the pivot itself it points nowhere
  return rt::shortestRotation({0, 0, -1}, norm(forearm_m) > 0 ? forearm_m : forward_);
}

void SimulatedHand::step(const Vec3& force_n_in_world) {
  force_n_ = limited(force_n_in_world);
  if (is_led_) {
    follow();
  } else {
    aim(-dot(force_n_, forward_));
  }
  move(force_n_);
}

void SimulatedHand::lead(const Vec3& target_m_in_world) {
  if (!isFinite(target_m_in_world)) return;
  target_ = target_m_in_world;
  silence_s_ = 0;
  if (std::exchange(is_led_, true)) return;
  system_ = ledSystemOf(settings_);
  for (Motion& axis : axes_) axis.become(system_);
}

/// Aims at the person's target, but no farther ahead of the handle than the largest force stretches the
/// spring.
void SimulatedHand::follow() {
  const bool rested = silence_s_ >= kLeadSilence_s;
  silence_s_ += step_s_;
  if (!rested && silence_s_ >= kLeadSilence_s) target_ = position_m_in_world();
  const Vec3 ahead = target_ - position_m_in_world();
  const double reach_m = kLead_n / kLeadStiffness_n_per_m;
  aim_ = position_m_in_world() + (reach_m / std::max(norm(ahead), reach_m)) * ahead;
  aim_velocity_ = {};
  if (silence_s_ >= kScriptAgain_s) letGo();
}

/// Goes on with the script, which begins with moving to the start.
void SimulatedHand::letGo() {
  is_led_ = false;
  beginRound();
  taps_left_ = 0;
  aim_ = position_m_in_world();
  turn_ = settings_.start_m_in_world;
  phase_ = Phase::retreating;
}

void SimulatedHand::beginRound() {
  action_ = actionOf(settings_.script, rounds_);
  taps_left_ = action_ == HandScript::tap ? kTaps : 0;
  system_ = systemOf(settings_, gripFor(action_));
  for (Motion& axis : axes_) axis.become(system_);
}

void SimulatedHand::aim(double force_n) {
  phase_time_s_ += step_s_;
  switch (phase_) {
    case Phase::approaching:
      advanceAim();
      if (force_n >= kPressedShare * std::max(targetForce_n() - friction_n_, 0.0)) {
        phase_ = Phase::pressing;
        phase_time_s_ = 0;
      } else if (progress(aim_) >= settings_.travel_m - kRounding_m) {
        taps_left_ = 0;
        leave();
      }
      break;
    case Phase::pressing:
      advanceAim();
      if (action_ == HandScript::stroke) stroke();
      if (phase_time_s_ >= (action_ == HandScript::tap ? kTap_s : settings_.press_s)) leave();
      break;
    case Phase::retreating:
      retreat();
      break;
  }
}

/// A lean builds up to the press force during half of its time.
double SimulatedHand::targetForce_n() const {
  if (action_ != HandScript::lean) return settings_.press_force_n;
  if (phase_ == Phase::approaching) return kFirstTouchShare * settings_.press_force_n;
  const double build_up = 2 * phase_time_s_ / std::max(settings_.press_s, step_s_);
  const double tremor = kTremorShare * std::sin(2 * std::numbers::pi * kTremor_hz * phase_time_s_);
  return std::clamp(build_up, kFirstTouchShare, 1.0) * (1 + tremor) * settings_.press_force_n;
}

/// Starts the retreat: to the start, or only a little between two taps.
void SimulatedHand::leave() {
  phase_ = Phase::retreating;
  taps_left_ = std::max(taps_left_ - 1, 0);
  const double turn_m = taps_left_ > 0 ? std::max(progress(aim_) - kLift_m, 0.0) : 0;
  turn_ = settings_.start_m_in_world + turn_m * forward_;
}

/// Advances the aim along the approach at the hand's speed, but no farther ahead of the handle than the
/// target force stretches the hand's spring, and neither beyond the travel nor behind the start.
void SimulatedHand::advanceAim() {
  const double before = progress(aim_);
  const double free = std::min(before + settings_.speed_m_per_s * step_s_, settings_.travel_m);
  const double ahead = progress(position_m_in_world()) + targetForce_n() / system_.hand_stiffness_n_per_m;
  const double after = std::max(std::min(free, ahead), 0.0);
  aim_ += (after - before) * forward_;
  // While the aim is held back, the damper opposes all motion, which keeps the contact stable.
  aim_velocity_ = after < free ? Vec3{} : ((after - before) / step_s_) * forward_;
}

void SimulatedHand::stroke() {
  const double angular_rate = 2 * std::numbers::pi / settings_.stroke_period_s;
  const double requested_m = settings_.stroke_m * std::sin(angular_rate * phase_time_s_);
  const double change = requested_m - dot(aim_ - settings_.start_m_in_world, across_);
  aim_ += change * across_;
  aim_velocity_ += (change / step_s_) * across_;
}

void SimulatedHand::retreat() {
  const Vec3 left = turn_ - aim_;
  const double distance = norm(left);
  const double step = settings_.speed_m_per_s * step_s_;
  if (distance > step) {
    aim_ += (step / distance) * left;
    aim_velocity_ = (settings_.speed_m_per_s / distance) * left;
    return;
  }
  aim_ = turn_;
  aim_velocity_ = {};
  phase_ = Phase::approaching;
  if (taps_left_ > 0) return;
  ++rounds_;
  beginRound();
}

void SimulatedHand::move(const Vec3& force_n) {
  const double damping = system_.hand_damping_n_s_per_m;
  axes_[0].advance(force_n.x, damping * aim_velocity_.x, aim_.x);
  axes_[1].advance(force_n.y, damping * aim_velocity_.y, aim_.y);
  axes_[2].advance(force_n.z, damping * aim_velocity_.z, aim_.z);
}

}  // namespace hapticd::drivers
