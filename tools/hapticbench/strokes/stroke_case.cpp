// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/stroke_case.h"

#include <cmath>

namespace hapticd::tools {

using rt::Vec3;

Vec3 StrokePath::hip_m(double stroked_m) const {
  const Vec3 first = approach_m(0);
  if (bend_radius_m == 0) return first + stroked_m * along;
  const double radius = bend_radius_m - depth_m;
  const double angle = stroked_m / radius;
  const Vec3 centre = start_m - bend_radius_m * outward;
  return centre + radius * (std::cos(angle) * outward + std::sin(angle) * along);
}

Vec3 StrokePath::direction(double stroked_m) const {
  if (length_m == 0) return {};
  if (bend_radius_m == 0) return along;
  const double angle = stroked_m / (bend_radius_m - depth_m);
  return std::cos(angle) * along - std::sin(angle) * outward;
}

Vec3 StrokePath::approach_m(double before_m) const {
  const Vec3 from = entry == Vec3{} ? outward : entry;
  return start_m + (before_m - depth_m) * from;
}

bool isSeen(const StrokeScene& scene, double distance_m) {
  constexpr double kFewest_px = 7.9;
  if (distance_m < scene.nearest_m) return false;
  return scene.narrowest_m * rt::DepthModelParameters{}.fx_px / distance_m >= kFewest_px;
}

}  // namespace hapticd::tools
