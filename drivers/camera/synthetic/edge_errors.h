// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rt/base/parameters.h"

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

/// What a camera that delivers depth gets wrong where a nearer surface ends in front of another one, by its
/// principle. In a resting scene it is the same in each frame. An edge is a change of the depth by more than
/// kEdgeJump from one pixel to the next, with both sides seen.
///
/// Stereo, whose image is that of the left imager:
/// - Nothing is measured where the right imager, `baseline_m` beside it, does not see the place: in a strip
/// of f b (1/Z_near - 1/Z_far) pixels to the left of the nearer surface, where a surface is steeper than the
/// right imager's line of sight, and in the f b / Z columns at the left border, which lie outside its view.
/// - The nearer surface seems wider, because matching windows at its rim contain it: by 0 up to half a window
/// (correlation_px), another width at each pixel.
///
/// Time of flight: half of the pixels at an edge contain it. These fly: their depth is a mixture of both
/// sides, with up to half of the other side.
///
/// Thread: any; applying does not change the object.  RT: not safe (allocates).
class EdgeErrors {
 public:
  /// Relative to the nearer depth. A plane reaches it from one pixel to the next only where the line of sight
  /// nearly lies in it: with f = 400 px, more than 83 degrees from its normal.
  static constexpr float kEdgeJump = 0.02F;

  /// `baseline_m`: between the imagers of a stereo camera.
  EdgeErrors(const rt::DepthModelParameters& camera, double baseline_m, std::uint32_t seed);

  /// Applies the errors to the exact depths of an image in metres, row by row without padding; not above 0:
  /// nothing seen.
  void applyTo(std::span<float> depths_m) const;

 private:
  void removeUnmatched(std::span<float> depths_m) const;
  void widen(std::span<const float> exact_m, std::span<float> depths_m) const;
  void mix(std::span<const float> exact_m, std::span<float> depths_m) const;
  std::uint32_t bitsOf(std::size_t pixel) const noexcept;

  rt::DepthModelParameters camera_;
  double focal_baseline_px_m_;
  std::uint32_t salt_;
};

/// Removes from a row of a stereo camera's image, exact depths in metres, what the other imager does not see,
/// which is at the right of the first one. `focal_baseline_px_m`: f b.
/// RT: not safe (allocates).
void removeUnmatchedIn(std::span<float> row_m, double focal_baseline_px_m);

}  // namespace hapticd::drivers
