// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hapticd::tools {

struct Rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Rgb&) const = default;
};

inline constexpr Rgb kNoDepthColour{0, 0, 0};
inline constexpr Rgb kHipColour{255, 0, 0};
inline constexpr Rgb kProxyColour{255, 255, 255};
inline constexpr Rgb kNeighbourColour{255, 140, 0};

/// The colour of a depth, in perceptually even steps: yellow at near_m, dark violet at far_m.
/// Source: samples of the colour map viridis (van der Walt, Smith, 2015, public domain), linear in between.
Rgb colourOfDepth(double depth_m, double near_m, double far_m);

}  // namespace hapticd::tools
