// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/occlusion.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kEdge_m = 0.1;         // of the block, beside the optical axis
constexpr double kBackground_m = 0.35;  // from the front to the wall behind the block
constexpr double kOutside_m = 0.05;
constexpr double kInside_m = 0.04;
constexpr double kBehind_m = 0.1;
constexpr double kFront_m = 0.03;
constexpr double kHandStep_m = 1e-4;  // 0.1 m/s
constexpr long kWait_ticks = 600;
constexpr double kClear_m = 0.002;
constexpr double kNone_n = 0.1;
constexpr double kHandRow_m = 0.0117;

/// x where the last column of the image that is measured meets a depth, to the right.
double borderAt(const rt::DepthModelParameters& camera, double depth_m) {
  return (drivers::SensorNoise::kFirstDeadColumn - 0.5 - camera.cx_px) / camera.fx_px * depth_m;
}

rt::DepthModelParameters cameraOf(const EntryCase& entry) {
  constexpr double kBefore_m = 0.1;
  if (entry.noise != SceneNoise::none) return {};
  return fineDepthModel(entry.wall_m - kBefore_m, entry.wall_m + kBackground_m + kBefore_m);
}

OccludedSceneParameters bodyOf(const EntryCase& entry) {
  OccludedSceneParameters body;
  const bool has_side = entry.kind == EntryKind::visible_side || entry.kind == EntryKind::hidden_side;
  if (has_side) body.background_m = entry.wall_m + kBackground_m;
  if (entry.kind == EntryKind::visible_side) body.left_m = kEdge_m;
  if (entry.kind == EntryKind::hidden_side) body.right_m = kEdge_m;
  return body;
}

/// The straight path of the hand.
struct EntryPath {
  Vec3 from_m;
  Vec3 to_m;
};
EntryPath pathOf(const EntryCase& entry, const rt::DepthModelParameters& camera) {
  const double level = -(entry.wall_m + entry.below_m);
  const auto at = [level](double x) { return Vec3{x, kHandRow_m, level}; };
  const double border = borderAt(camera, entry.wall_m + entry.below_m);
  switch (entry.kind) {
    case EntryKind::visible_side:
      return {at(kEdge_m - kOutside_m), at(kEdge_m + kInside_m)};
    case EntryKind::hidden_side:
      return {at(kEdge_m + kOutside_m), at(kEdge_m - kInside_m)};
    case EntryKind::from_behind:
      return {{0.0213, kHandRow_m, -(entry.wall_m + kBehind_m)},
              {0.0213, kHandRow_m, -(entry.wall_m - kFront_m)}};
    case EntryKind::into_image:
      return {at(border + kOutside_m), at(border - kInside_m)};
    case EntryKind::out_of_image:
      return {at(border - kInside_m), at(border + kOutside_m)};
  }
  return {};
}

/// Returns the distance in metres from the HIP out of the solid through its side; infinite without a side.
double toSide_m(const EntryCase& entry, const Vec3& hip) {
  if (entry.kind == EntryKind::visible_side) return hip.x - kEdge_m;
  if (entry.kind == EntryKind::hidden_side) return kEdge_m - hip.x;
  return std::numeric_limits<double>::infinity();
}

/// `pitch_m`: of a pixel; the image shows no better where the body ends.
EntryTick truthAt(const EntryCase& entry, const Vec3& hip, double stiffness, double pitch_m) {
  const double to_front = -hip.z - entry.wall_m;
  const double to_side = toSide_m(entry, hip);
  const double depth = std::min(to_front, to_side);
  const double clear = std::max(kClear_m, pitch_m);
  EntryTick tick{.force_n = {},
                 .inside = depth > clear,
                 .outside = depth < -clear,
                 .through_front_n = {0, 0, stiffness * std::max(0.0, to_front)},
                 .through_side_n = {}};
  if (std::isfinite(to_side) && to_side > 0) {
    const double outward = entry.kind == EntryKind::visible_side ? -1 : 1;
    tick.through_side_n = {outward * stiffness * to_side, 0, 0};
  }
  return tick;
}

bool isAbout(const Vec3& force_n, const Vec3& true_n) {
  constexpr double kShare = 0.2;
  constexpr double kMin_n = 0.5;
  return norm(true_n) > 0 && norm(force_n - true_n) <= std::max(kMin_n, kShare * norm(true_n));
}

}  // namespace

std::string_view nameOf(EntryKind kind) {
  constexpr std::array<std::string_view, 5> kNames{"visible_side", "hidden_side", "from_behind", "into_image",
                                                   "out_of_image"};
  return kNames.at(static_cast<std::size_t>(kind));
}

void EntryResult::add(const EntryResult& other) {
  inside += other.inside;
  of_body += other.of_body;
  none_reported += other.none_reported;
  none_silent += other.none_silent;
  wrong += other.wrong;
  ghost_n = std::max(ghost_n, other.ghost_n);
  sideways_n = std::max(sideways_n, other.sideways_n);
}

EntryResult judgeEntry(const std::vector<EntryTick>& ticks) {
  EntryResult result;
  for (const EntryTick& tick : ticks) {
    if (tick.through_side_n == Vec3{})
      result.sideways_n = std::max(result.sideways_n, std::abs(tick.force_n.x));
    if (tick.outside) result.ghost_n = std::max(result.ghost_n, norm(tick.force_n));
    if (!tick.inside) continue;
    ++result.inside;
    if (norm(tick.force_n) <= kNone_n) {
      ++(tick.state == rt::ContactState::behind ? result.none_reported : result.none_silent);
    } else if (isAbout(tick.force_n, tick.through_front_n) || isAbout(tick.force_n, tick.through_side_n)) {
      ++result.of_body;
    } else {
      ++result.wrong;
    }
  }
  return result;
}

EntryResult runEntry(const std::string& law, const EntryCase& entry) {
  const rt::DepthModelParameters camera = cameraOf(entry);
  OccludedScene scene(bodyOf(entry), camera, entry.noise, entry.seed);
  const auto box = shippedBox(law, entry.wall_m, camera);
  const double stiffness = box->parameters().force.stiffness_n_per_m;
  FramePlayer player(*box, renderedStream([&](long, std::uint64_t number, rt::DepthFrame& frame) {
    scene.render({.wall_m = entry.wall_m}, number, frame);
  }));
  const EntryPath path = pathOf(entry, camera);
  const double length_m = norm(path.to_m - path.from_m);
  const auto moving = std::lround(length_m / kHandStep_m);
  // a hand that leaves the image presses from the front first
  const bool presses = entry.kind == EntryKind::out_of_image;
  std::vector<EntryTick> ticks;
  for (long tick = 0; tick < kWait_ticks + moving; ++tick) {
    const double share =
        std::clamp(static_cast<double>(tick - kWait_ticks) / static_cast<double>(moving), 0.0, 1.0);
    Vec3 hip = path.from_m + share * (path.to_m - path.from_m);
    if (presses) {
      const double remaining_m = kHandStep_m * static_cast<double>(kWait_ticks - 100 - tick);
      hip.z += std::clamp(remaining_m, 0.0, kFront_m + entry.below_m);
    }
    EntryTick judged = truthAt(entry, hip, stiffness, entry.wall_m / camera.fx_px);
    const rt::Tick now = player.tick(hip);
    judged.force_n = now.law_force_n_in_world;
    judged.state = now.contact;
    if (tick >= kWait_ticks) ticks.push_back(judged);
  }
  return judgeEntry(ticks);
}

namespace {

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
  const double stiffness = box->parameters().force.stiffness_n_per_m;
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
