// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <random>
#include <thread>

#include "rt/base/vec3.h"
#include "tests/vendor_devices/mapped_arm.h"
#include "tests/vendor_devices/phantom_omni/omni_memory.h"

namespace hapticd::test {

/// Waist, shoulder, elbow.
using OmniJoints = std::array<double, 3>;

/// The angles while the stylus is docked: those of the driver's source, written down a second time.
inline constexpr OmniJoints kOmniDocked_rad{0, 0.23, -0.37};

/// What a driver has to find out of a device, and what acts on its arm.
struct OmniModelSettings {
  OmniJoints n_m_per_count{3e-4, 3e-4, 3e-4};
  OmniJoints friction_n_m{0.015, 0.015, 0.015};
  OmniJoints inertia_kg_m2{0.002, 0.003, 0.0015};
  double own_mass_kg = 0.04;  ///< of the forearm, as if at the wrist
  /// With the mass on the stylus, the load's inertia is added.
  double hanging_kg = 0;     ///< from the stylus
  double pull_right_kg = 0;  ///< over a pulley
};

/// The rigid arm of an Omni, with friction and stops, under gravity. Thread: one.
class OmniModel {
 public:
  OmniModelSettings settings;
  OmniJoints angles_rad = kOmniDocked_rad;
  OmniJoints velocity_rad_per_s{};

  /// Moves on by `seconds`, at most 1 ms.
  void step(double seconds, const OmniJoints& motor_n_m);

  /// The wrist: x to the right, y up, z to the person, from the axis of waist and shoulder.
  static rt::Vec3 wristAt(const OmniJoints& angles_rad);
  /// Its derivatives, by differences.
  static std::array<rt::Vec3, 3> leversAt(const OmniJoints& angles_rad);
  /// The force at the wrist that the torques exert.
  static rt::Vec3 forceOf(const OmniJoints& angles_rad, const OmniJoints& torque_n_m);

 private:
  OmniJoints loads_n_m() const;
};

/// A pose in the inner part of the workspace, where the arm is not stretched.
OmniJoints randomOmniPose(std::mt19937& random);

/// Gains with random sizes and signs.
OmniJoints randomOmniGains(std::mt19937& random);

/// An Omni in real time, which lives on when the program that drives it is killed. It is docked until a test
/// puts it elsewhere, and then either held there by a hand or free to move. Thread: one.
class EmulatedOmni {
 public:
  /// Without packets the motors let go after that long: a loaded machine sends none for some milliseconds.
  static constexpr std::int64_t kRelease_ns = 40'000'000;

  EmulatedOmni(const std::filesystem::path& path, const OmniModelSettings& settings, unsigned int seed = 1);
  ~EmulatedOmni();

  OmniMemory& memory() const { return mapped_.memory(); }
  void setFaults(std::uint32_t faults) { memory().faults = faults; }
  void resetBus();

  /// A hand brings it there, and holds it: the stylus is docked once it has arrived.
  void dock();
  void holdAt(const OmniJoints& angles_rad);
  /// Whether it is where the hand brings it.
  bool hasArrived() const { return arrived_; }
  /// Nobody holds it.
  void letGo();
  /// Changes the model's settings.
  template <typename Change>
  void change(Change change) {
    const std::lock_guard lock(mutex_);
    change(model_);
  }
  /// It keeps its torque without packets.
  void keepsTorque() { keeps_torque_ = true; }

  bool motorsOn() const { return (memory().bits & 8U) != 0; }
  bool isExerting() const { return exerting_; }
  /// When a joint had torque last, CLOCK_MONOTONIC.
  std::int64_t lastTorque_ns() const { return last_torque_ns_; }
  /// The force that its motors exert at the wrist now.
  rt::Vec3 force_n() const;
  double mostForce_n() const { return most_force_n_; }
  void forgetMostForce() { most_force_n_ = 0; }
  OmniJoints angles_rad() const;

 private:
  void run();
  OmniJoints torques_n_m() const;
  void measure();

  MappedMemory<OmniMemory> mapped_;
  void moveHand(double seconds);

  mutable std::mutex mutex_;  // of the four below
  OmniModel model_;
  bool held_ = true;
  OmniJoints hand_rad_ = kOmniDocked_rad;  // where it brings the arm
  bool docks_ = true;
  std::atomic<bool> arrived_{true};
  std::array<int, 3> zero_counts_{};  // of the encoders, where angles are zero
  std::atomic<bool> keeps_torque_{false};
  std::atomic<bool> exerting_{false};
  std::atomic<std::int64_t> last_torque_ns_{0};
  std::atomic<double> most_force_n_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
