// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hapticd::drivers {

/// State of a SpaceMouse's cap; each value stays valid until a report changes it.
struct SpaceMouseState {
  /// x right, y towards the user, z down; +-350, on older devices +-500.
  std::array<std::int16_t, 3> translation{};
  std::array<std::int16_t, 3> rotation{};
  std::uint32_t buttons = 0;
};

/// Processes an input report, which begins with its id: 1 translation, or all six axes; 2 rotation; 3
/// buttons. Others (such as the battery state) are ignored. Returns false for a report with one of these ids
/// that has a wrong length or an impossible deflection.
/// RT: safe.
bool takeOver(SpaceMouseState& state, std::span<const std::uint8_t> report);

}  // namespace hapticd::drivers
