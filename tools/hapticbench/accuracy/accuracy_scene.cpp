// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_scene.h"

#include <numbers>

#include "tools/lib/truth/fine_depth_model.h"

namespace hapticd::tools {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A camera of fine depth steps that covers everything in front of and behind the scene that a law can reach.
rt::DepthModelParameters fineCameraFor(const TrueSceneParameters& shape, double distance_m) {
  constexpr double kBehind_m = 0.1;
  constexpr double kMargin_m = 0.02;
  const bool has_wall = shape.kind == SceneKind::thin_plate;
  return fineDepthModelAround(distance_m, has_wall ? shape.wall_behind_m + kMargin_m : kBehind_m);
}

}  // namespace

const std::vector<AccuracyScene>& accuracyScenes() {
  static const std::vector<AccuracyScene> scenes{
      {"plane", {.kind = SceneKind::plane}},
      {"plane30", {.kind = SceneKind::plane, .tilt_rad = 30 * kDegree}},
      {"plane60", {.kind = SceneKind::plane, .tilt_rad = 60 * kDegree}},
      {"sphere", {.kind = SceneKind::sphere, .radius_m = 0.05}},
      {"bowl", {.kind = SceneKind::bowl, .radius_m = 0.05}},
      {"cylinder", {.kind = SceneKind::cylinder, .radius_m = 0.02}},
      {"edge", {.kind = SceneKind::convex_edge}},
      {"half_plane", {.kind = SceneKind::half_plane}},
      {"corner", {.kind = SceneKind::inner_corner}},
      {"plate", {.kind = SceneKind::thin_plate}},
      {"step", {.kind = SceneKind::step}},
  };
  return scenes;
}

TrueScene AccuracyScene::at(double distance_m, SceneNoise noise, std::uint32_t seed) const {
  TrueSceneParameters placed = shape;
  placed.distance_m = distance_m;
  const rt::DepthModelParameters kinect;
  return TrueScene(placed, noise == SceneNoise::none ? fineCameraFor(shape, distance_m) : kinect, seed);
}

const rt::DepthFrame& FrameReel::frame(int index) {
  // The noise repeats after 1.3 s, long after any law has forgotten it.
  constexpr int kFrames = 40;
  const int place = isSensorNoise(noise_) ? index % kFrames : 0;
  if (place >= static_cast<int>(rendered_.size())) rendered_.resize(static_cast<std::size_t>(place) + 1);
  auto& frame = rendered_[static_cast<std::size_t>(place)];
  const auto number = static_cast<std::uint64_t>(index) + 1;
  if (!frame) {
    frame = std::make_unique<rt::DepthFrame>();
    scene_.render(0, number, noise_, *frame);
  }
  frame->sequence = number;
  return *frame;
}

}  // namespace hapticd::tools
