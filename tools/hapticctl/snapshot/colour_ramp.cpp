// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/colour_ramp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace hapticd::tools {
namespace {

constexpr std::array<Rgb, 9> kViridis{{{68, 1, 84},
                                       {71, 44, 122},
                                       {59, 81, 139},
                                       {44, 113, 142},
                                       {33, 144, 141},
                                       {39, 173, 129},
                                       {92, 200, 99},
                                       {170, 220, 50},
                                       {253, 231, 37}}};

std::uint8_t between(std::uint8_t low, std::uint8_t high, double share) {
  return static_cast<std::uint8_t>(std::lround(low + share * (high - low)));
}

}  // namespace

Rgb colourOfDepth(double depth_m, double near_m, double far_m) {
  const double nearness = std::clamp((far_m - depth_m) / (far_m - near_m), 0.0, 1.0);
  const double place = nearness * static_cast<double>(kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double share = place - static_cast<double>(below);
  const Rgb& low = kViridis[below];
  const Rgb& high = kViridis[below + 1];
  return {between(low.red, high.red, share), between(low.green, high.green, share),
          between(low.blue, high.blue, share)};
}

}  // namespace hapticd::tools
