#include "tools/haptic-bridge/simulated_device.h"

#include <algorithm>

#include "drivers/monotonic_clock.h"

namespace hapticd::tools {

DeviceReading SimulatedDevice::read() {
  constexpr std::int64_t kStepNs = 1'000'000;
  const std::int64_t now_ns = drivers::monotonicNs();
  std::int64_t left_ns = read_ns_ == 0 ? 0 : std::min(now_ns - read_ns_, kMostCatchUpNs);
  read_ns_ = now_ns;
  while (left_ns > 0) {
    const std::int64_t step_ns = std::min(left_ns, kStepNs);
    hand_.step(static_cast<double>(step_ns) * 1e-9, force_n_);
    left_ns -= step_ns;
  }
  DeviceReading reading;
  reading.position_m = hand_.position_m_in_world();
  reading.velocity_m_per_s = hand_.velocity_m_per_s_in_world();
  reading.velocity_valid = true;
  return reading;
}

}  // namespace hapticd::tools
