// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_spacemouse.h"

#include "rt/clock.h"

namespace hapticd::drivers {

HidSpaceMouse::HidSpaceMouse(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale)
    : frame_(settings, scale),
      motion_(settings.hid.full_speed_m_per_s / scale.motion_scale, kReachM / scale.motion_scale) {}

void HidSpaceMouse::opened(std::int64_t now_ns) {
  cap_ = {};
  last_ns_ = now_ns;
  frame_.beginSession();
}

void HidSpaceMouse::take(std::span<const std::uint8_t> report) {
  if (!takeOver(cap_, report)) ++rejected_;
}

rt::HandleState HidSpaceMouse::state(std::int64_t now_ns) {
  motion_.step(cap_, static_cast<double>(now_ns - last_ns_) / static_cast<double>(rt::kNsPerSecond));
  last_ns_ = now_ns;
  ++measurements_;
  HandleMeasurement measurement;
  measurement.position_m_in_handle = motion_.position_m();
  measurement.velocity_m_per_s_in_handle = motion_.velocity_m_per_s();
  measurement.time_ns = now_ns;
  measurement.buttons = cap_.buttons;
  return frame_.stateOf(measurement);
}

}  // namespace hapticd::drivers
