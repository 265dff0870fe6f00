// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_spacemouse.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "drivers/handle/hid/hid_settings.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Axes = std::array<std::int16_t, 3>;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kTranslationId = 1;
constexpr std::uint8_t kRotationId = 2;
constexpr std::uint8_t kButtonsId = 3;
constexpr std::size_t kAxesBytes = 6;
// Of devices with up to 48 buttons, of which 32 are distinguished.
constexpr std::size_t kMaxButtonBytes = 6;

// The logical maximum of the oldest devices, with a margin for a cap that exceeds it.
constexpr int kMaxDeflection = 1000;

/// Returns nothing for an impossible deflection.
std::optional<Axes> axesFrom(Bytes bytes) {
  Axes axes{};
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    axes[axis] = static_cast<std::int16_t>(bytes[2 * axis] | (bytes[2 * axis + 1] << 8));
    if (std::abs(axes[axis]) > kMaxDeflection) return std::nullopt;
  }
  return axes;
}

bool takeAxes(Axes& axes, Bytes bytes) {
  const auto taken = axesFrom(bytes);
  if (taken) axes = *taken;
  return taken.has_value();
}

bool takeSixAxes(SpaceMouseState& state, Bytes bytes) {
  SpaceMouseState taken = state;
  if (!takeAxes(taken.translation, bytes.first(kAxesBytes))) return false;
  if (!takeAxes(taken.rotation, bytes.subspan(kAxesBytes))) return false;
  state = taken;
  return true;
}

std::uint32_t buttonsFrom(Bytes bytes) {
  std::uint32_t buttons = 0;
  for (std::size_t byte = 0; byte < std::min<std::size_t>(bytes.size(), 4); ++byte) {
    buttons |= std::uint32_t{bytes[byte]} << (8 * byte);
  }
  return buttons;
}

}  // namespace

bool takeOver(SpaceMouseState& state, Bytes report) {
  if (report.empty()) return false;
  const Bytes content = report.subspan(1);
  switch (report.front()) {
    case kTranslationId:
      if (content.size() == 2 * kAxesBytes) return takeSixAxes(state, content);
      return content.size() == kAxesBytes && takeAxes(state.translation, content);
    case kRotationId:
      return content.size() == kAxesBytes && takeAxes(state.rotation, content);
    case kButtonsId:
      if (content.empty() || content.size() > kMaxButtonBytes) return false;
      state.buttons = buttonsFrom(content);
      return true;
    default:
      return true;
  }
}

namespace {

/// Returns the fraction of the full speed, -1..1.
double shareOf(int deflection) {
  constexpr double kRange = SpaceMouseMotion::kFullDeflection - SpaceMouseMotion::kDeadZone;
  const int beyond = std::max(0, std::abs(deflection) - SpaceMouseMotion::kDeadZone);
  return std::copysign(std::min(1.0, beyond / kRange), deflection);
}

}  // namespace

void SpaceMouseMotion::step(const SpaceMouseState& cap, double dt_s) {
  const double step_s = std::clamp(dt_s, 0.0, kMaxStepS);
  const auto& [right, towards, down] = cap.translation;
  stepAxis(&rt::Vec3::x, right, step_s);
  stepAxis(&rt::Vec3::y, -down, step_s);
  stepAxis(&rt::Vec3::z, towards, step_s);
}

void SpaceMouseMotion::stepAxis(double rt::Vec3::*axis, int deflection, double dt_s) {
  const double speed = full_speed_m_per_s_ * shareOf(deflection);
  const double target = position_.*axis + speed * dt_s;
  position_.*axis = std::clamp(target, -reach_m_, reach_m_);
  velocity_.*axis = position_.*axis == target ? speed : 0;
}

HidSpaceMouse::HidSpaceMouse(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale)
    : frame_(settings, scale),
      motion_(settings.of<HidHandleSettings>().full_speed_m_per_s / scale.motion_scale,
              kReachM / scale.motion_scale) {}

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
