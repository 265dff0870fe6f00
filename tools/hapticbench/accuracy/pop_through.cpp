// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/pop_through.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::tools {
namespace {

constexpr double kContact_n = 0.25;
constexpr double kIdealContact_n = 0.5;

}  // namespace

PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n) {
  PopThrough push;
  for (std::size_t tick = 0; tick < outward_n.size(); ++tick) {
    const double force_n = outward_n[tick];
    if (force_n > push.largest_n) {
      push.dipped = push.dipped || push.popped;
      push.popped = false;
      push.largest_n = force_n;
      push.largest_tick = tick;
      continue;
    }
    const bool gives_way = push.largest_n >= kContact_n && force_n < push.largest_n / 2;
    const bool holds_nothing = ideal_n[tick] >= kIdealContact_n && force_n <= 0;
    push.popped = push.popped || gives_way || holds_nothing;
  }
  return push;
}

double popThroughForceOnPlane_n(const rt::SpringParameters& springs, const rt::DepthModelParameters& camera,
                                double depth_m) {
  constexpr int kHeights = 4000;
  const double points_per_m2 = camera.fx_px * camera.fy_px / (depth_m * depth_m);
  const double disc_radius_m = std::sqrt(springs.max_points / (std::numbers::pi * points_per_m2));
  double largest_n = 0;
  for (int i = 1; i < kHeights; ++i) {
    const double height_m = springs.radius_m * i / kHeights;
    const double farthest_m = std::min(std::hypot(height_m, disc_radius_m), springs.radius_m);
    largest_n = std::max(largest_n, springs.stiffness_n_per_m * height_m *
                                        (2 * springs.radius_m / (height_m + farthest_m) - 1));
  }
  return largest_n;
}

}  // namespace hapticd::tools
