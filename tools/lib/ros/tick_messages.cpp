// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/tick_messages.h"

#include <algorithm>
#include <array>
#include <bit>

#include "rt/base/clock.h"

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

constexpr bool modesAreInOrder() {
  for (std::size_t i = 0; i < kModes.size(); ++i) {
    if (static_cast<std::size_t>(kModes[i].mode) != i) return false;
  }
  return true;
}
static_assert(modesAreInOrder());

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

std::optional<Measurement> TickMessages::newMeasurement(const rt::Tick& tick) {
  const rt::HandleState& handle = tick.handle;
  if (handle.sequence == measurement_ || !isMeasured(tick)) return std::nullopt;
  measurement_ = handle.sequence;
  const rt::Quaternion orientation = handle.has_orientation ? handle.orientation_in_world : rt::Quaternion{};
  return Measurement{
      handle.time_ns, {handle.position_m_in_world, orientation}, handle.velocity_m_per_s_in_world};
}

std::optional<HeldButtons> TickMessages::newButtons(const rt::Tick& tick) {
  const rt::HandleState& handle = tick.handle;
  if (handle.sequence == 0 || (handle.buttons == buttons_ && tick.planned_ns < next_buttons_ns_))
    return std::nullopt;
  buttons_ = handle.buttons;
  next_buttons_ns_ = tick.planned_ns + rt::kNsPerSecond;
  button_count_ = std::max(button_count_, static_cast<std::size_t>(std::bit_width(handle.buttons)));
  HeldButtons message{.time_ns = handle.time_ns, .axes = {}, .held = {}};
  for (std::size_t i = 0; i < button_count_; ++i) message.held.push_back((handle.buttons >> i) & 1U ? 1 : 0);
  if (handle.has_gripper) message.axes.push_back(static_cast<float>(handle.gripper_rad));
  return message;
}

void TickMessages::restart() {
  measurement_ = 0;
  buttons_.reset();
}

std::optional<rt::Vec3> commandedForce(const rt::Tick& tick) {
  if (!isFinite(tick.command_force_n_in_world)) return std::nullopt;
  return tick.command_force_n_in_world;
}

}  // namespace hapticd::tools::ros
