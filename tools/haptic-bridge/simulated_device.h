// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/handle/simulated/simulated_hand.h"
#include "tools/haptic-bridge/device.h"

namespace hapticd::tools {

/// A drivers::SimulatedHand in real time: between two readings it moves by the whole steps that
/// have passed, at most kMostCatchUpNs.
class SimulatedDevice final : public Device {
 public:
  static constexpr std::int64_t kStepNs = 250'000;
  static constexpr std::int64_t kMostCatchUpNs = 50'000'000;

  /// The settings are taken to be in the device's frame.
  explicit SimulatedDevice(const config::SimulatedHandleSettings& settings)
      : hand_(settings, static_cast<double>(kStepNs) * 1e-9) {}

  DeviceReading read() override;
  void setForce(const rt::Vec3& force_n) override { force_n_ = force_n; }

 private:
  drivers::SimulatedHand hand_;
  rt::Vec3 force_n_;
  std::int64_t moved_to_ns_ = 0;
};

}  // namespace hapticd::tools
