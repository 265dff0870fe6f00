// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/surface_stroke.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kDepth_m = 0.008;
constexpr double kStart_m = 0.03;
constexpr double kStep_m = 1e-4;  // 0.1 m/s at 1 kHz
constexpr int kWaitTicks = 700;   // 20 frames, more than any law takes a mean over
constexpr int kStillTicks = 2000;
constexpr int kCalmTicks = 150;  // from the end of the push to where forces count
constexpr double kLongestStroke_m = 0.1;
constexpr double kBorder_m = 0.025;  // from the end of a stroke to where the surface is no longer known

int strokeTicks(const RestingSurface& surface) {
  const double length_m = std::clamp(surface.size_m - 2 * kBorder_m, 0.0, kLongestStroke_m);
  return static_cast<int>(std::lround(length_m / kStep_m));
}

/// A path over a surface in steps of equal length.
class SurfaceWalk {
 public:
  SurfaceWalk(const RestingSurface& surface, const CameraDisparity& camera, Handling handling)
      : surface_(surface),
        camera_(camera),
        across_column_(handling == Handling::along_row ? 1 : 0),
        across_row_(handling == Handling::along_column ? 1 : 0),
        column_(surface.column),
        row_(surface.row) {}

  void step(double length_m) {
    if (length_m == 0) return;
    const auto ahead = surfacePoint(camera_, surface_.fit, column_ + across_column_, row_ + across_row_);
    const double pixels = length_m / norm(ahead.position_m - point().position_m);
    column_ += pixels * across_column_;
    row_ += pixels * across_row_;
  }
  SurfacePoint point() const { return surfacePoint(camera_, surface_.fit, column_, row_); }

 private:
  const RestingSurface& surface_;
  const CameraDisparity& camera_;
  double across_column_;
  double across_row_;
  double column_;
  double row_;
};

StrokeTick tickAt(const SurfacePoint& point, double depth_m, double stiffness) {
  return {.hip_m = point.position_m - depth_m * point.normal,
          .true_force_n = stiffness * std::max(0.0, depth_m) * point.normal,
          .normal = point.normal,
          .along = {},
          .presses = false};
}

}  // namespace

std::vector<StrokeTick> handleSurface(const RestingSurface& surface, const CameraDisparity& camera,
                                      Handling handling, double stiffness_n_per_m) {
  SurfaceWalk walk(surface, camera, handling);
  const bool strokes = handling != Handling::still;
  const int stroke_ticks = strokes ? strokeTicks(surface) : 0;
  walk.step(-kStep_m * stroke_ticks / 2);
  std::vector<StrokeTick> ticks;
  const auto stay = [&](double depth_m, int count, bool presses) {
    for (int i = 0; i < count; ++i) {
      ticks.push_back(tickAt(walk.point(), depth_m, stiffness_n_per_m));
      ticks.back().presses = presses;
    }
  };
  stay(-kStart_m, kWaitTicks, false);
  for (double depth_m = -kStart_m; depth_m < kDepth_m; depth_m += kStep_m) stay(depth_m, 1, false);
  stay(kDepth_m, kCalmTicks, false);
  if (!strokes) stay(kDepth_m, kStillTicks, true);
  for (int i = 0; i < stroke_ticks; ++i) {
    const Vec3 before = walk.point().position_m;
    walk.step(kStep_m);
    const Vec3 moved = walk.point().position_m - before;
    stay(kDepth_m, 1, true);
    ticks.back().along = (1 / norm(moved)) * moved;
  }
  return ticks;
}

}  // namespace hapticd::tools
