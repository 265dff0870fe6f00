// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/vec3.h"

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

}  // namespace hapticd::tools
