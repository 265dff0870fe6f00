#include "drivers/handle/simulated/simulated_hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::drivers {
namespace {

using rt::Vec3;

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vec3 unit(const Vec3& a) {
  return (1 / norm(a)) * a;
}

/// At right angles to `forward` and to the world's y axis, or to its x axis where forward is along y.
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

}  // namespace

SimulatedHand::SimulatedHand(const config::SimulatedHandleSettings& settings)
    : settings_(settings),
      forward_(unit(settings.direction_in_world)),
      across_(acrossOf(forward_)),
      position_(settings.start_m_in_world),
      aim_(settings.start_m_in_world) {}

void SimulatedHand::step(double dt_s, const Vec3& force_n_in_world) {
  const Vec3 force_n = limited(force_n_in_world);
  aim(dt_s, -dot(force_n, forward_));
  move(dt_s, force_n);
}

void SimulatedHand::aim(double dt_s, double felt_n) {
  phase_time_s_ += dt_s;
  switch (phase_) {
    case Phase::approaching:
      advanceAim(dt_s);
      if (felt_n >= kPressedShare * settings_.press_force_n) {
        phase_ = Phase::pressing;
        phase_time_s_ = 0;
      } else if (progress(aim_) >= settings_.travel_m) {
        phase_ = Phase::retreating;
      }
      break;
    case Phase::pressing:
      advanceAim(dt_s);
      stroke(dt_s);
      if (phase_time_s_ >= settings_.press_s) phase_ = Phase::retreating;
      break;
    case Phase::retreating:
      retreat(dt_s);
      break;
  }
}

/// Along the approach: forward at the hand's speed, but no farther ahead of the handle than the press force
/// stretches the hand's spring, and neither beyond the travel nor behind the start.
void SimulatedHand::advanceAim(double dt_s) {
  const double before = progress(aim_);
  const double free = std::min(before + settings_.speed_m_per_s * dt_s, settings_.travel_m);
  const double ahead = progress(position_) + settings_.press_force_n / settings_.hand_stiffness_n_per_m;
  const double after = std::max(std::min(free, ahead), 0.0);
  aim_ += (after - before) * forward_;
  // While held back the damper works against all motion: it is what keeps the contact stable.
  aim_velocity_ = after < free ? Vec3{} : ((after - before) / dt_s) * forward_;
}

void SimulatedHand::stroke(double dt_s) {
  const double angular_rate = 2 * std::numbers::pi / settings_.stroke_period_s;
  const double wanted = settings_.stroke_m * std::sin(angular_rate * phase_time_s_);
  const double change = wanted - dot(aim_ - settings_.start_m_in_world, across_);
  aim_ += change * across_;
  aim_velocity_ += (change / dt_s) * across_;
}

void SimulatedHand::retreat(double dt_s) {
  const Vec3 way = settings_.start_m_in_world - aim_;
  const double distance = norm(way);
  const double step = settings_.speed_m_per_s * dt_s;
  if (distance > step) {
    aim_ += (step / distance) * way;
    aim_velocity_ = (settings_.speed_m_per_s / distance) * way;
    return;
  }
  aim_ = settings_.start_m_in_world;
  aim_velocity_ = {};
  phase_ = Phase::approaching;
  ++rounds_;
}

/// m dv/dt = k (aim - x) + b_h (v_aim - v) - b v + F with x and v of the end of the step.
void SimulatedHand::move(double dt_s, const Vec3& force_n) {
  const double stiffness = settings_.hand_stiffness_n_per_m;
  const double hand_damping = settings_.hand_damping_n_s_per_m;
  const double inertia =
      settings_.mass_kg + dt_s * (settings_.damping_n_s_per_m + hand_damping) + dt_s * dt_s * stiffness;
  const Vec3 pull_n = stiffness * (aim_ - position_) + hand_damping * aim_velocity_ + force_n;
  velocity_ = (1 / inertia) * (settings_.mass_kg * velocity_ + dt_s * pull_n);
  position_ += dt_s * velocity_;
}

}  // namespace hapticd::drivers
