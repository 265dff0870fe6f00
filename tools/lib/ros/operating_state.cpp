// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/operating_state.h"

#include <array>
#include <cstddef>

namespace hapticd::tools::ros {
namespace {

struct ModeRow {
  rt::Mode mode;
  std::string_view state;
  bool is_busy;
};
constexpr std::array kModes{
    ModeRow{rt::Mode::starting, "DISABLED", true},
    ModeRow{rt::Mode::idle, "DISABLED", false},
    ModeRow{rt::Mode::engaged, "ENABLED", false},
    // engaged, and without force until a cause that ends by itself has ended
    ModeRow{rt::Mode::holding, "PAUSED", false},
    ModeRow{rt::Mode::faulted, "FAULT", false},
};
static_assert(kModes.size() == rt::kModeCount, "each mode needs its row");

constexpr bool areInOrder() {
  for (std::size_t i = 0; i < kModes.size(); ++i) {
    if (static_cast<std::size_t>(kModes[i].mode) != i) return false;
  }
  return true;
}
static_assert(areInOrder());

bool isCalibrated(const rt::HandleState& handle) {
  return handle.sequence > 0 && handle.condition != rt::HandleCondition::not_calibrated;
}

}  // namespace

OperatingState operatingStateOf(const rt::Tick& tick) {
  const ModeRow& row = kModes[static_cast<std::size_t>(tick.mode)];
  const bool is_recent = tick.planned_ns - tick.handle.time_ns < kMeasurementLife_ns;
  const bool is_homing =
      is_recent && tick.handle.sequence > 0 && tick.handle.condition == rt::HandleCondition::not_calibrated;
  return {row.state, is_recent && isCalibrated(tick.handle), row.is_busy || is_homing};
}

bool isMeasured(const rt::Tick& tick) {
  const rt::HandleState& handle = tick.handle;
  return isCalibrated(handle) && isFinite(handle.position_m_in_world) &&
         isFinite(handle.velocity_m_per_s_in_world);
}

}  // namespace hapticd::tools::ros
