// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/border_push.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "tools/hapticbench/accuracy/pop_through.h"
#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/lib/truth/fine_depth_model.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kBodyEdge_m = 0.1;
constexpr double kBackgroundBehind_m = 0.35;
constexpr double kHandFrom_m = 0.03;
constexpr double kHandTo_m = 0.045;  // 22.5 N at 500 N/m
constexpr double kStillBefore_m = 0.02;
constexpr double kSurfaceDisplacement_m = 0.06;
constexpr long kBeforePush_ticks = 700;
constexpr double kTickOfPush_s = 0.001;
constexpr double kPopLimit_n = 20;
constexpr double kTwoFrames_s = 2.0 / 30;

rt::DepthModelParameters cameraOf(const BorderPushCase& push) {
  if (push.noise != SceneNoise::none) return {};
  return fineDepthModel(push.wall_m - 0.15, push.wall_m + kBackgroundBehind_m + 0.05);
}

OccludedSceneParameters bodyOf(const BorderPushCase& push) {
  OccludedSceneParameters body;
  if (push.kind == BorderKind::image_border) return body;
  body.background_m = push.wall_m + kBackgroundBehind_m;
  (push.kind == BorderKind::silhouette_visible ? body.left_m : body.right_m) = kBodyEdge_m;
  return body;
}

/// Returns the point at which the hand pushes, at the level of the front.
Vec3 footOf(const BorderPushCase& push, const rt::DepthModelParameters& camera) {
  constexpr double kRow_m = 0.0117;
  switch (push.kind) {
    case BorderKind::silhouette_hidden:
      return {kBodyEdge_m - push.beside_m, kRow_m, -push.wall_m};
    case BorderKind::silhouette_visible:
      return {kBodyEdge_m + push.beside_m, kRow_m, -push.wall_m};
    case BorderKind::image_border:
      break;
  }
  // in sight also where a surface that moves has come nearest
  const double border_px = drivers::SensorNoise::kFirstDeadColumn - 0.5;
  const double border_m = (border_px - camera.cx_px) / camera.fx_px * (push.wall_m - kSurfaceDisplacement_m);
  return {border_m - push.beside_m, kRow_m, -push.wall_m};
}

}  // namespace

std::string_view nameOf(BorderKind kind) {
  constexpr std::array<std::string_view, 3> kNames{"hidden side", "visible side", "image border"};
  return kNames.at(static_cast<std::size_t>(kind));
}

void BorderPushResult::add(const BorderPushResult& other) {
  pushes += other.pushes;
  popped += other.popped;
  least_n = std::min(least_n, other.least_n);
}

BorderPushResult runBorderPush(const std::string& law, const BorderPushCase& push) {
  const rt::DepthModelParameters camera = cameraOf(push);
  OccludedScene scene(bodyOf(push), camera, push.noise, push.seed);
  const auto box = shippedBox(law, push.wall_m, camera);
  const double stiffness = box->parameters().springs.stiffness_n_per_m;
  const auto movedBy = [&push](long tick, double most_m) {
    const auto since = static_cast<double>(std::max(0L, tick - kBeforePush_ticks));
    return std::min(most_m, push.speed_m_per_s * kTickOfPush_s * since);
  };
  const auto wallAt = [&](long tick) {
    return push.wall_m - (push.surface_moves ? movedBy(tick, kSurfaceDisplacement_m) : 0);
  };
  FramePlayer player(*box, renderedStream([&](long tick, std::uint64_t number, rt::DepthFrame& frame) {
    scene.render({.wall_m = wallAt(tick)}, number, frame);
  }));
  const Vec3 foot = footOf(push, camera);
  const double displacement_m = push.surface_moves ? kSurfaceDisplacement_m : kHandFrom_m + kHandTo_m;
  const long end = kBeforePush_ticks + std::lround(displacement_m / push.speed_m_per_s / kTickOfPush_s);
  std::vector<double> outward_n;
  std::vector<double> ideal_n;
  for (long tick = 0; tick < end; ++tick) {
    const double in_front_m =
        push.surface_moves ? kStillBefore_m : kHandFrom_m - movedBy(tick, displacement_m);
    const Vec3 hip = foot + Vec3{0, 0, in_front_m};
    const double force_n = player.tick(hip).law_force_n_in_world.z;
    if (tick < kBeforePush_ticks) continue;
    outward_n.push_back(force_n);
    // What the law can know: the surface comes on for up to two frames before it is seen there.
    const double unseen_m = push.surface_moves ? push.speed_m_per_s * kTwoFrames_s : 0;
    ideal_n.push_back(stiffness * std::max(0.0, -hip.z - wallAt(tick) - unseen_m));
  }
  const PopThrough judged = judgePush(outward_n, ideal_n);
  return {.pushes = 1, .popped = judged.under(kPopLimit_n) ? 1 : 0, .least_n = judged.largest_n};
}

}  // namespace hapticd::tools
