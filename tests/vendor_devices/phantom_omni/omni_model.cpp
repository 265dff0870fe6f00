// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/phantom_omni/omni_model.h"

#include <algorithm>
#include <cmath>

namespace hapticd::test {
namespace {

constexpr double kLink_m = 0.135;
constexpr double kGravity_m_per_s2 = 9.80665;
struct Stops {
  double low_rad;
  double high_rad;
};
constexpr std::array<Stops, 3> kStops{Stops{-0.98, 0.98}, Stops{0, 1.75}, Stops{-0.81, 1.25}};

/// Rotation about the upward axis of a frame with x away from the person and z up, and about its y axis.
rt::Vec3 turnedAboutZ(const rt::Vec3& v, double angle) {
  return {std::cos(angle) * v.x - std::sin(angle) * v.y, std::sin(angle) * v.x + std::cos(angle) * v.y, v.z};
}
rt::Vec3 turnedAboutY(const rt::Vec3& v, double angle) {
  return {std::cos(angle) * v.x + std::sin(angle) * v.z, v.y, -std::sin(angle) * v.x + std::cos(angle) * v.z};
}

}  // namespace

rt::Vec3 OmniModel::wristAt(const OmniJoints& angles_rad) {
  const rt::Vec3 upper_arm = turnedAboutY({-kLink_m, 0, 0}, angles_rad[1]);
  const rt::Vec3 forearm = turnedAboutY({0, 0, -kLink_m}, angles_rad[2]);
  const rt::Vec3 at = turnedAboutZ(upper_arm + forearm, angles_rad[0]);
  return {-at.y, at.z, -at.x};
}

std::array<rt::Vec3, 3> OmniModel::leversAt(const OmniJoints& angles_rad) {
  constexpr double kStep_rad = 1e-6;
  std::array<rt::Vec3, 3> levers;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    OmniJoints more = angles_rad;
    OmniJoints less = angles_rad;
    more[joint] += kStep_rad;
    less[joint] -= kStep_rad;
    levers[joint] = 0.5 / kStep_rad * (wristAt(more) - wristAt(less));
  }
  return levers;
}

rt::Vec3 OmniModel::forceOf(const OmniJoints& angles_rad, const OmniJoints& torque_n_m) {
  const auto [a, b, c] = leversAt(angles_rad);
  const double volume = dot(a, cross(b, c));
  return 1 / volume *
         (torque_n_m[0] * cross(b, c) + torque_n_m[1] * cross(c, a) + torque_n_m[2] * cross(a, b));
}

OmniJoints OmniModel::loads_n_m() const {
  const auto levers = leversAt(angles_rad);
  OmniJoints loads{};
  for (std::size_t joint = 0; joint < 3; ++joint)
    loads[joint] = -kGravity_m_per_s2 * (settings.hanging_kg + settings.own_mass_kg) * levers[joint].y;
  // the string leaves the arm at a right angle
  loads[0] += kGravity_m_per_s2 * settings.pull_right_kg * norm(levers[0]);
  return loads;
}

void OmniModel::step(double seconds, const OmniJoints& motor_n_m) {
  const OmniJoints loads = loads_n_m();
  const double moved_kg = settings.hanging_kg + settings.pull_right_kg;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    double& angle = angles_rad[joint];
    double& velocity = velocity_rad_per_s[joint];
    const double inertia = settings.inertia_kg_m2[joint] + moved_kg * kLink_m * kLink_m;
    const double friction = settings.friction_n_m[joint];
    const double drive = motor_n_m[joint] + loads[joint];
    const double free = velocity + seconds * drive / inertia;
    const double held = seconds * friction / inertia;  // friction stops at most
    velocity = std::abs(free) <= held ? 0 : free - std::copysign(held, free);
    angle += seconds * velocity;
    const auto [low, high] = kStops[joint];
    if (angle < low || angle > high) velocity = 0;
    angle = std::clamp(angle, low, high);
  }
}

OmniJoints randomOmniPose(std::mt19937& random) {
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  return {between(-0.9, 0.9), between(0.1, 1.2), between(-0.3, 0.9)};
}

OmniJoints randomOmniGains(std::mt19937& random) {
  std::uniform_real_distribution<double> size(3e-4, 7e-4);
  std::bernoulli_distribution negative(0.5);
  OmniJoints gains{};
  for (double& gain : gains) gain = negative(random) ? -size(random) : size(random);
  return gains;
}

}  // namespace hapticd::test
