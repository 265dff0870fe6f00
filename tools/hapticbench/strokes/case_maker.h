// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tools/hapticbench/strokes/stroke_case.h"

namespace hapticd::tools {

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr double kLongest_m = 0.16;       // of a stroke
inline constexpr double kWallBehind_m = 0.12;    // from a body's front to the wall behind it
inline constexpr double kLargestPatch_m = 0.04;  // the fact sheet's patch
inline constexpr double kBlockThickness_m = 0.06;
inline constexpr double kBeforeEnd_m = 0.07;  // of a stroke that leaves its body
inline constexpr double kAfterEnd_m = 0.03;
// Of a rod's radius: a proxy moves aside by 1 / (1 - this) times what the HIP does, so that nearer to the
// axis nothing but the error of the rod's position is measured.
inline constexpr double kDeepestOnRod = 0.6;

/// The ray through a point of the image, at depth 1.
inline rt::Vec3 rayThrough(double column, double row) {
  const rt::DepthModelParameters camera;
  return {(column - camera.cx_px) / camera.fx_px, -(row - camera.cy_px) / camera.fy_px, -1};
}

/// Places the cases of one scene in front of the camera, a little different for each scene by chance.
/// Thread: one.
class CaseMaker {
 public:
  CaseMaker(const CasePlacement& placement, std::mt19937& random) : placement_(placement), random_(random) {
    constexpr double kAside_px = 20;
    column_ = 320 + uniform(-kAside_px, kAside_px);
    row_ = 240 + uniform(-kAside_px, kAside_px);
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double distance_m() const { return placement_.distance_m; }
  double depth_m() const { return placement_.depth_m; }
  bool deadColumns() const { return placement_.dead_columns; }

  /// Length of a stroke; shorter near the camera, so that one that runs towards it stays in its range.
  double length_m() const { return std::min(kLongest_m, 0.25 * placement_.distance_m); }

  /// The point that the scene is built around.
  rt::Vec3 middle_m() const { return placement_.distance_m * rayThrough(column_, row_); }
  rt::Vec3 at_m(double column, double row) const { return placement_.distance_m * rayThrough(column, row); }

  /// A frame whose origin is there, whose z axis is `outward` and whose x axis is `along` as far as that
  /// lies across.
  static RigidFrame frame(const rt::Vec3& origin_m, const rt::Vec3& outward, const rt::Vec3& along) {
    const rt::Vec3 x = unitOf(along - dot(along, outward) * outward);
    return {origin_m, x, cross(outward, x), outward};
  }
  /// Facing the camera, its x axis turned in the image by `turn_rad` from the image's own.
  RigidFrame facing(double turn_rad) const {
    return frame(middle_m(), {0, 0, 1}, {std::cos(turn_rad), std::sin(turn_rad), 0});
  }
  /// Facing away from the camera's axis by `tilt_rad` about the image's direction `axis_rad`, which is the x
  /// axis.
  RigidFrame tilted(double tilt_rad, double axis_rad) const {
    const rt::Vec3 axis{std::cos(axis_rad), std::sin(axis_rad), 0};
    return frame(middle_m(), turned({0, 0, 1}, tilt_rad * axis), axis);
  }

  /// A stroke over the surface z = 0 whose middle is `middle_m`.
  StrokePath straight(const rt::Vec3& middle_m, const rt::Vec3& along, double length_m) const {
    return {.start_m = middle_m - (length_m / 2) * along,
            .outward = {0, 0, 1},
            .along = along,
            .length_m = length_m,
            .depth_m = depth_m()};
  }

  /// Returns the length of a stroke along the surface z = 0 before the body ends at the origin.
  double beforeEnd_m() const { return std::min(kBeforeEnd_m, length_m()); }
  /// A stroke over the surface z = 0 out over its end at the origin.
  StrokePath outOver(const rt::Vec3& along) const { return toOrigin(along, kAfterEnd_m); }
  /// A stroke over the surface z = 0 as deep into another one, which it meets at the origin.
  StrokePath into(const rt::Vec3& along) const { return toOrigin(along, depth_m()); }

  /// The wall that faces the camera behind the scene, in the frame of the scene's bodies.
  TrueBody wallBehind(const RigidFrame& bodies) const {
    const rt::Vec3 outward = bodies.directionIn({0, 0, 1});
    const rt::Vec3 on_wall = bodies.positionIn(middle_m() - rt::Vec3{0, 0, kWallBehind_m});
    return ConvexBody{{{outward, dot(outward, on_wall)}}};
  }

 private:
  StrokePath toOrigin(const rt::Vec3& along, double beyond_m) const {
    return {.start_m = -beforeEnd_m() * along,
            .outward = {0, 0, 1},
            .along = along,
            .length_m = beforeEnd_m() + beyond_m,
            .depth_m = depth_m()};
  }

  const CasePlacement& placement_;
  std::mt19937& random_;
  double column_;
  double row_;
};

}  // namespace hapticd::tools
