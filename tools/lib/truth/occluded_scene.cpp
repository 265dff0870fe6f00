// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/occluded_scene.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools {
namespace {

constexpr double kMissed = 2;  // a share beyond the end of the segment
// The projector of a Kinect is that far to the right of its camera, so that shadows lie to the left of
// bodies.
constexpr double kProjector_m = 0.075;
constexpr PlanPoint kCamera{0, 0};
constexpr double kFarAway_m = 100;

/// The shares of a segment at which it enters and leaves lowest..highest along one axis.
struct Stretch {
  double first;
  double last;
};
Stretch within(double from, double to, double lowest, double highest) {
  const double step = to - from;
  if (step == 0) return from >= lowest && from <= highest ? Stretch{-kFarAway_m, kFarAway_m} : Stretch{1, 0};
  const double a = (lowest - from) / step;
  const double b = (highest - from) / step;
  return {std::min(a, b), std::max(a, b)};
}

double meetsBox(const PlanPoint& from, const PlanPoint& to, const PlanPoint& lowest,
                const PlanPoint& highest) {
  const Stretch across = within(from.x_m, to.x_m, lowest.x_m, highest.x_m);
  const Stretch along = within(from.depth_m, to.depth_m, lowest.depth_m, highest.depth_m);
  const double first = std::max(across.first, along.first);
  const double last = std::min(across.last, along.last);
  return first <= last && last >= 0 && first <= 1 ? std::max(first, 0.0) : kMissed;
}

/// Returns where the segment meets the ellipse, computed in a frame in which the ellipse is the unit circle.
double meetsEllipse(const PlanPoint& from, const PlanPoint& to, const PlanPoint& middle, double half_width,
                    double half_thickness) {
  const PlanPoint start{(from.x_m - middle.x_m) / half_width,
                        (from.depth_m - middle.depth_m) / half_thickness};
  const PlanPoint segment{(to.x_m - from.x_m) / half_width, (to.depth_m - from.depth_m) / half_thickness};
  const double a = segment.x_m * segment.x_m + segment.depth_m * segment.depth_m;
  const double b = start.x_m * segment.x_m + start.depth_m * segment.depth_m;
  const double c = start.x_m * start.x_m + start.depth_m * start.depth_m - 1;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return kMissed;
  const double share = (-b - std::sqrt(discriminant)) / a;
  return share >= 0 && share <= 1 ? share : kMissed;
}

}  // namespace

double meetsOccluder(const OccludedSceneParameters& p, double occluder_x_m, const PlanPoint& from,
                     const PlanPoint& to) {
  const double half_width = p.width_m / 2;
  switch (p.occluder) {
    case OccluderShape::none:
      return kMissed;
    case OccluderShape::box:
      return meetsBox(from, to, {occluder_x_m - half_width, p.back_m - p.thickness_m},
                      {occluder_x_m + half_width, p.back_m});
    case OccluderShape::elliptic_cylinder:
      return meetsEllipse(from, to, {occluder_x_m, p.back_m - p.thickness_m / 2}, half_width,
                          p.thickness_m / 2);
  }
  return kMissed;
}

OccludedScene::OccludedScene(const OccludedSceneParameters& parameters,
                             const rt::DepthModelParameters& camera, SceneNoise noise, std::uint32_t seed)
    : parameters_(parameters),
      noise_(noise),
      camera_(camera),
      sensor_(seed, /*leaves_shadows=*/false) {}  // shadows come from the rays themselves

double OccludedScene::depth_m(int column, const OccludedMoment& moment) const {
  const double slope = camera_.rayThrough(column, 0).x;  // x per depth
  double depth = kFarAway_m;
  // the block: its front, or the side of it that faces the optical axis
  const double at_front = slope * moment.wall_m;
  if (at_front >= parameters_.left_m && at_front <= parameters_.right_m) {
    depth = moment.wall_m;
  } else {
    const double side_x = at_front < parameters_.left_m ? parameters_.left_m : parameters_.right_m;
    const double side_depth = slope != 0 ? side_x / slope : kFarAway_m;
    if (side_depth > moment.wall_m) depth = side_depth;
  }
  if (parameters_.background_m > 0) depth = std::min(depth, parameters_.background_m);
  const PlanPoint far_end{slope * kFarAway_m, kFarAway_m};
  const double met = meetsOccluder(parameters_, moment.occluder_x_m, kCamera, far_end);
  if (met <= 1) depth = std::min(depth, met * kFarAway_m);
  if (depth >= kFarAway_m) return 0;
  if (!parameters_.projector_shadow) return depth;
  // up to just before the surface itself
  constexpr double kBefore = 1 - 1e-6;
  const PlanPoint seen{slope * depth, depth};
  const PlanPoint before{kProjector_m + kBefore * (seen.x_m - kProjector_m), kBefore * seen.depth_m};
  return meetsOccluder(parameters_, moment.occluder_x_m, {kProjector_m, 0}, before) <= 1 ? 0 : depth;
}

void OccludedScene::render(const OccludedMoment& moment, std::uint64_t frame_number, rt::DepthFrame& frame) {
  const bool is_linear = camera().law == rt::DepthLawKind::linear;
  std::vector<float> of_column;
  for (int column = 0; column < camera().width_px; ++column) {
    const double depth = depth_m(column, moment);
    if (depth <= 0) {
      of_column.push_back(drivers::kNothingSeen);
    } else {
      of_column.push_back(is_linear ? camera_.exactDepth_m(1 / depth) : camera_.exactDisparity(1 / depth));
    }
  }
  std::vector<float>& exact = camera_.exact();
  for (std::size_t pixel = 0; pixel < exact.size(); ++pixel)
    exact[pixel] = of_column[pixel % of_column.size()];
  sensor_.deliver(camera_, frame_number, noise_, frame);
}

}  // namespace hapticd::tools
