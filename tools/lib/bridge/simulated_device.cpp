// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/simulated_device.h"

#include <algorithm>

#include "rt/base/clock.h"

namespace hapticd::tools {

DeviceReading SimulatedDevice::read() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (moved_to_ns_ == 0) moved_to_ns_ = now_ns;
  moved_to_ns_ = std::max(moved_to_ns_, now_ns - kMaxCatchUpNs);
  for (; now_ns - moved_to_ns_ >= kStepNs; moved_to_ns_ += kStepNs) hand_.step(force_n_);
  DeviceReading reading;
  reading.position_m = hand_.position_m_in_world();
  reading.velocity_m_per_s = hand_.velocity_m_per_s_in_world();
  reading.velocity_valid = true;
  reading.orientation = hand_.orientation_in_world();
  reading.gripper_rad = hand_.gripper_rad();
  return reading;
}

}  // namespace hapticd::tools
