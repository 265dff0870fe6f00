// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/phantom_omni/emulated_omni.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "rt/base/clock.h"

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

namespace {

constexpr std::int64_t kStep_ns = 250'000;
constexpr int kNoTorque = 0x7ff;
constexpr OmniJoints kCountsPerRad{15000 / (2 * std::numbers::pi), -15000 / (2 * std::numbers::pi),
                                   15000 / (2 * std::numbers::pi)};

}  // namespace

EmulatedOmni::EmulatedOmni(const std::filesystem::path& path, const OmniModelSettings& settings,
                           unsigned int seed)
    : mapped_(path, true) {
  model_.settings = settings;
  std::mt19937 random(seed);
  // encoders begin anywhere, also where they wrap around in use
  std::uniform_int_distribution<int> anywhere(-32768, 32767);
  for (int& zero : zero_counts_) zero = anywhere(random);
  memory().docked = true;
  measure();
  thread_ = std::thread([this] { run(); });
}

EmulatedOmni::~EmulatedOmni() {
  ends_ = true;
  thread_.join();
}

void EmulatedOmni::resetBus() {
  memory().channels_taken = 0;
  ++memory().generation;
}

void EmulatedOmni::dock() {
  holdAt(kOmniDocked_rad);
  const std::lock_guard lock(mutex_);
  docks_ = true;
}

void EmulatedOmni::holdAt(const OmniJoints& angles_rad) {
  const std::lock_guard lock(mutex_);
  hand_rad_ = angles_rad;
  held_ = true;
  docks_ = arrived_ = false;
  memory().docked = false;
}

/// As fast as a hand, so that no position jumps.
void EmulatedOmni::moveHand(double seconds) {
  constexpr double kSpeed_rad_per_s = 3;
  bool arrived = true;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    double& angle_rad = model_.angles_rad[joint];
    const double missing_rad = hand_rad_[joint] - angle_rad;
    const double most_rad = kSpeed_rad_per_s * seconds;
    angle_rad += std::clamp(missing_rad, -most_rad, most_rad);
    arrived = arrived && std::abs(missing_rad) <= most_rad;
  }
  model_.velocity_rad_per_s = {};
  arrived_ = arrived;
  memory().docked = docks_ && arrived;
}

void EmulatedOmni::letGo() {
  const std::lock_guard lock(mutex_);
  held_ = docks_ = false;
  memory().docked = false;
}

OmniJoints EmulatedOmni::angles_rad() const {
  const std::lock_guard lock(mutex_);
  return model_.angles_rad;
}

rt::Vec3 EmulatedOmni::force_n() const {
  const std::lock_guard lock(mutex_);
  return OmniModel::forceOf(model_.angles_rad, torques_n_m());
}

OmniJoints EmulatedOmni::torques_n_m() const {
  const bool released = rt::monotonicNow_ns() - memory().packet_ns > kRelease_ns && !keeps_torque_;
  OmniJoints torques{};
  if (released || !motorsOn()) return torques;
  for (std::size_t joint = 0; joint < 3; ++joint)
    torques[joint] = (memory().dac[joint] - kNoTorque) * model_.settings.n_m_per_count[joint];
  return torques;
}

void EmulatedOmni::measure() {
  for (std::size_t joint = 0; joint < 3; ++joint) {
    const auto counts = std::lround(kCountsPerRad[joint] * model_.angles_rad[joint]);
    memory().encoders[joint] = zero_counts_[joint] + static_cast<int>(counts);
  }
}

void EmulatedOmni::run() {
  std::int64_t moved_to_ns = rt::monotonicNow_ns();
  while (!ends_) {
    rt::sleepUntil(moved_to_ns + kStep_ns);
    const std::int64_t now_ns = rt::monotonicNow_ns();
    const std::lock_guard lock(mutex_);
    const OmniJoints torques = torques_n_m();
    exerting_ = std::ranges::any_of(torques, [](double torque) { return torque != 0; });
    if (exerting_) last_torque_ns_ = now_ns;
    if (held_)
      most_force_n_ = std::max(most_force_n_.load(), norm(OmniModel::forceOf(model_.angles_rad, torques)));
    // a loaded machine: the arm does not wait for it, but makes no leaps either
    constexpr std::int64_t kMostBehind_ns = 10'000'000;
    moved_to_ns = std::max(moved_to_ns, now_ns - kMostBehind_ns);
    for (; now_ns - moved_to_ns >= kStep_ns; moved_to_ns += kStep_ns) {
      constexpr double kStep_s = static_cast<double>(kStep_ns) * 1e-9;
      held_ ? moveHand(kStep_s) : model_.step(kStep_s, torques);
    }
    measure();
  }
}

}  // namespace hapticd::test
