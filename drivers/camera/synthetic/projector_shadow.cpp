// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/projector_shadow.h"

#include <limits>

namespace hapticd::drivers {

void removeShadow(std::span<float> disparities, ShadowSide side, double pixels_per_raw) {
  if (side == ShadowSide::none) return;
  // Position of a pixel in the projector's image, counted away from the projector: column - pixels_per_raw *
  // disparity. To be lit, it must lie beyond all pixels before it.
  const auto scale = static_cast<float>(pixels_per_raw);
  const std::size_t count = disparities.size();
  float farthest = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    float& disparity = disparities[side == ShadowSide::right ? i : count - 1 - i];
    if (disparity < 0) continue;
    const float in_projector = static_cast<float>(i) - scale * disparity;
    if (in_projector < farthest) {
      disparity = kNothingSeen;
    } else {
      farthest = in_projector;
    }
  }
}

}  // namespace hapticd::drivers
