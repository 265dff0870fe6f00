// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <variant>

#include "tools/hapticbench/strokes/strokes.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kPatch_m = 0.16;
constexpr FloorFrames kResting{.count = 8};
constexpr FloorFrames kMoving{.count = 3, .moving = true};

FloorFrames framesOf(const StrokeCase& stroke) {
  return stroke.motion.rests() ? kResting : kMoving;
}

/// The face as a patch that faces the camera and has as many pixels.
FloorError flatFloor(const StrokeCase& stroke, const drivers::SensorNoise::Parameters& noise,
                     double distance_m, double stiffness_n_per_m) {
  const Vec3 place = stroke.T_camera_bodies.positionOut(stroke.path.hip_m(stroke.path.length_m / 2));
  const Vec3 outward = stroke.T_camera_bodies.directionOut(stroke.path.outward);
  const double to_normal = std::abs(dot(outward, (1 / -place.z) * place));  // of an error in depth
  const FloorPatch patch{.side_m = kPatch_m * std::sqrt(to_normal),
                         .distance_m = distance_m,
                         .off_centre = std::max(0.0, 1 - 2 * stroke.beside_edge_m / kPatch_m),
                         .frames = framesOf(stroke)};
  FloorError floor = noiseFloor(noise, {}, patch, stiffness_n_per_m);
  floor.depth_m *= to_normal;
  floor.force_n *= to_normal;
  floor.force_jnd *= to_normal;
  return floor;
}

/// `body`: radius and axis, in the frame of the bodies.
FloorError curvedFloor(const StrokeCase& stroke, FloorBody body,
                       const drivers::SensorNoise::Parameters& noise, double stiffness_n_per_m) {
  constexpr int kPlaces = 3;  // spread evenly over the stroke
  const StrokePath& path = stroke.path;
  FloorError sum{.determined = true};
  const auto add = [](double& mean_square, double value) { mean_square += value * value / kPlaces; };
  for (int i = 0; i < kPlaces; ++i) {
    const double stroked_m = (i + 0.5) / kPlaces * path.length_m;
    const Vec3 along = path.direction(stroked_m);
    const Vec3 outward =
        path.bend_radius_m == 0 ? path.outward : unitOf(cross(along, cross(path.outward, along)));
    const RigidFrame& bodies = stroke.T_camera_bodies;
    body.outward = bodies.directionOut(outward);
    body.along = bodies.directionOut(along);
    body.contact_m = bodies.positionOut(path.hip_m(stroked_m)) + path.depth_m * body.outward;
    const FloorError floor = noiseFloor(noise, {}, body, stiffness_n_per_m);
    if (!floor.determined) return floor;
    add(sum.depth_m, floor.depth_m);
    add(sum.force_n, floor.force_n);
    add(sum.force_jnd, floor.force_jnd);
    add(sum.tilt_force_n, floor.tilt_force_n);
  }
  for (double* figure : {&sum.depth_m, &sum.force_n, &sum.force_jnd, &sum.tilt_force_n})
    *figure = std::sqrt(*figure);
  return sum;
}

}  // namespace

FloorError strokeFloor(const StrokeCase& stroke, SceneNoise noise, double distance_m,
                       double stiffness_n_per_m) {
  const drivers::SensorNoise::Parameters sensor = sensorParameters(noise);
  const bool has_crease = std::holds_alternative<HollowBody>(stroke.bodies.front());
  if (stroke.held_in_front || has_crease) return {};
  FloorBody body{.depth_m = stroke.path.depth_m, .frames = framesOf(stroke)};
  if (const auto* ball = std::get_if<BallBody>(&stroke.bodies.front())) {
    body.radius_m = ball->radius_m;
    return curvedFloor(stroke, body, sensor, stiffness_n_per_m);
  }
  if (const auto* rod = std::get_if<RodBody>(&stroke.bodies.front())) {
    body.radius_m = rod->radius_m;
    body.axis = stroke.T_camera_bodies.x;
    return curvedFloor(stroke, body, sensor, stiffness_n_per_m);
  }
  return flatFloor(stroke, sensor, distance_m, stiffness_n_per_m);
}

}  // namespace hapticd::tools
