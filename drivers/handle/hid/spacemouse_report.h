// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hapticd::drivers {

/// What a SpaceMouse has said of its cap so far: each value stands until a report brings another one.
struct SpaceMouseState {
  std::array<std::int16_t, 3>
      translation{};  ///< x right, y towards the user, z down; +-350, older ones +-500
  std::array<std::int16_t, 3> rotation{};
  std::uint32_t buttons = 0;
};

/// Takes over an input report, which begins with its id: 1 translation, or all six axes in one; 2 rotation;
/// 3 buttons. Others (a battery's state) change nothing.
/// False for a report of one of these ids that has another length or a deflection that no cap reaches.
/// RT: safe.
bool takeOver(SpaceMouseState& state, std::span<const std::uint8_t> report);

}  // namespace hapticd::drivers
