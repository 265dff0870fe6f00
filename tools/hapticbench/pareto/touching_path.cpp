// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/touching_path.h"

#include <cmath>
#include <numbers>

#include "tools/lib/truth/rigid_frame.h"

namespace hapticd::tools {
namespace {

/// Any unit vector at a right angle to `direction`.
rt::Vec3 perpendicularTo(const rt::Vec3& direction) {
  const rt::Vec3 other = std::abs(direction.x) < 0.5 ? rt::Vec3{1, 0, 0} : rt::Vec3{0, 1, 0};
  const rt::Vec3 across = other - dot(other, direction) * direction;
  return unitOf(across);
}

}  // namespace

std::vector<rt::Vec3> touchingPath(const rt::Vec3& surface_m, const rt::Vec3& inward, int ticks,
                                   double radius_m, double speed_up) {
  // the largest speeds of the two motions, 0.38 and 0.31 m/s, are at right angles
  constexpr double kCircle_hz = 1;
  constexpr double kStroke_m = 0.025;
  constexpr double kStroke_hz = 2;
  constexpr double kMiddle_m = -0.01;
  const rt::Vec3 across = perpendicularTo(inward);
  const rt::Vec3 along = cross(inward, across);
  std::vector<rt::Vec3> path;
  for (int tick = 0; tick < ticks; ++tick) {
    const double turns = speed_up * 2 * std::numbers::pi * tick / 1000.0;
    const double angle = kCircle_hz * turns;
    const double depth_m = kMiddle_m + kStroke_m * std::sin(kStroke_hz * turns);
    path.push_back(surface_m + (radius_m * std::cos(angle)) * across + (radius_m * std::sin(angle)) * along +
                   depth_m * inward);
  }
  return path;
}

}  // namespace hapticd::tools
