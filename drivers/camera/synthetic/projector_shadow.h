// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace hapticd::drivers {

/// On which side of a near body, in the image, the projector's light does not reach what is behind it.
enum class ShadowSide : std::uint8_t {
  none,
  left,
  right,
};

/// Marks the pixels of a row that the camera sees and the projector does not as kNothingSeen. With the
/// projector beside the camera at the distance B, a body at Z_n hides a strip of f B (1/Z_n - 1/Z_f) pixels
/// of what is at Z_f, and a surface steeper than the line to the projector is in its own shadow.
/// `disparities`: exact ones, left to right, growing with distance. `pixels_per_raw`: f B |d(1/Z)/d(raw)|.
/// RT: safe.
void removeShadow(std::span<float> disparities, ShadowSide side, double pixels_per_raw);

}  // namespace hapticd::drivers
