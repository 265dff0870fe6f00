// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/handle/simulated/simulated_hand.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

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
  void exert(const DeviceCommand& command) override { force_n_ = command.force_n; }
  DeviceLimits limits() const override { return {.force_n = 100}; }

 private:
  drivers::SimulatedHand hand_;
  rt::Vec3 force_n_;
  std::int64_t moved_to_ns_ = 0;
};

}  // namespace hapticd::tools
