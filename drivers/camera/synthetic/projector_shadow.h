// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace hapticd::drivers {

/// Value of an exact disparity or depth where the scene shows nothing at a pixel.
inline constexpr float kNothingSeen = -1;

/// Side of a near body in the image on which the projector does not illuminate what is behind it.
enum class ShadowSide : std::uint8_t {
  none,
  left,
  right,
};

/// Marks the pixels of a row that are seen by the camera but not by the projector as kNothingSeen. With the
/// projector at a distance B beside the camera, a body at Z_n hides a strip of f B (1/Z_n - 1/Z_f) pixels of
/// a surface at Z_f, and a surface steeper than the line to the projector shadows itself. `disparities`:
/// exact, left to right, growing with distance. `pixels_per_raw`: f B |d(1/Z)/d(raw)|.
/// RT: safe.
void removeShadow(std::span<float> disparities, ShadowSide side, double pixels_per_raw);

}  // namespace hapticd::drivers
