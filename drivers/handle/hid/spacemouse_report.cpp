// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/spacemouse_report.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

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

}  // namespace hapticd::drivers
