// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// What a device measures, in its own frame.
struct DeviceReading {
  rt::Vec3 position_m;
  rt::Vec3 velocity_m_per_s;
  bool velocity_valid = false;  ///< false: hapticd estimates it from the positions
  std::uint32_t buttons = 0;
  bool calibrated = true;
  bool fault = false;
};

/// A haptic device, as the libraries of vendors offer one. Another device needs nothing but these two
/// functions. Thread: one.
class Device {
 public:
  virtual ~Device() = default;
  virtual DeviceReading read() = 0;
  /// The force on the hand from now on, newtons in the device's frame; always finite.
  virtual void setForce(const rt::Vec3& force_n) = 0;
};

/// A drivers::SimulatedHand in real time: between two readings it moves by the whole steps that
/// have passed, at most kMaxCatchUpNs.
class SimulatedDevice final : public Device {
 public:
  static constexpr std::int64_t kStepNs = 250'000;
  static constexpr std::int64_t kMaxCatchUpNs = 50'000'000;

  /// The settings are taken to be in the device's frame.
  explicit SimulatedDevice(const drivers::SimulatedHandleSettings& settings)
      : hand_(settings, static_cast<double>(kStepNs) * 1e-9) {}

  DeviceReading read() override;
  void setForce(const rt::Vec3& force_n) override { force_n_ = force_n; }

 private:
  drivers::SimulatedHand hand_;
  rt::Vec3 force_n_;
  std::int64_t moved_to_ns_ = 0;
};

}  // namespace hapticd::tools
