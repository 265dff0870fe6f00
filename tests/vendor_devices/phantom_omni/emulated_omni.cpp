// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/phantom_omni/emulated_omni.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "rt/base/clock.h"

namespace hapticd::test {
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
