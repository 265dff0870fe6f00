// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

namespace hapticd::rt {

/// How the disparity of a moving surface changes over the image: as a rate or as a displacement, raw units.
///
/// It is affine in the image, which any rigid motion of a plane is exactly: with the inverse depth w = P r on
/// the ray r = (x, y, 1), only P changes. A translation along the ray gives the value, two tilts the slopes;
/// motion within the plane does not show.
struct DisparityMotion {
  double column_px = 0;  ///< where `value` is
  double row_px = 0;
  double value = 0;
  double per_column = 0;  ///< change of the value per pixel to the right
  double per_row = 0;     ///< and downwards

  bool turns() const noexcept { return per_column != 0 || per_row != 0; }
  double at(double column, double row) const noexcept {
    return value + per_column * (column - column_px) + per_row * (row - row_px);
  }
  friend DisparityMotion operator*(double scale, DisparityMotion motion) noexcept {
    motion.value *= scale;
    motion.per_column *= scale;
    motion.per_row *= scale;
    return motion;
  }
};
static_assert(std::is_trivially_copyable_v<DisparityMotion>);

}  // namespace hapticd::rt
