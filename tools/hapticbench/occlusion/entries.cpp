// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/occlusion/occlusion.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {

using rt::Vec3;

Vec3 outOf(BlockSide side) {
  constexpr std::array<Vec3, 4> kOut{{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
  return kOut.at(static_cast<std::size_t>(side));
}

TrueBody blockWithSide(BlockSide side, double side_m, double wall_m) {
  constexpr double kWide_m = 0.2;
  const Vec3 out = outOf(side);
  const Vec3 across = cross({0, 0, 1}, out);
  return ConvexBody{{{{0, 0, 1}, -wall_m},
                     {out, side_m},
                     {-out, kWide_m - side_m},
                     {across, kWide_m / 2},
                     {-across, kWide_m / 2}}};
}

namespace {

constexpr double kEdge_m = 0.1;         // of the block, beside the optical axis
constexpr double kBackground_m = 0.35;  // from the front to the wall behind the block
constexpr double kOutside_m = 0.02;     // where the hand's path through a side begins
constexpr double kInside_m = 0.03;
constexpr double kBorder_m = 0.05;  // the same beside the image's border
constexpr double kBehind_m = 0.1;
constexpr double kFront_m = 0.03;
constexpr double kPeriod_s = 0.001;
constexpr long kWait_ticks = 600;
constexpr double kClear_m = 0.002;
constexpr double kNone_n = 0.1;
constexpr double kDirection_n = 0.5;  // from which on a force's direction is judged
constexpr long kEarly_ticks = 20;
constexpr double kHandRow_m = 0.0117;

/// x where the last column of the image that is measured meets a depth, to the right.
double borderAt(const rt::DepthModelParameters& camera, double depth_m) {
  return (drivers::SensorNoise::kFirstDeadColumn - 0.5 - camera.cx_px) / camera.fx_px * depth_m;
}

/// Without noise: of fine steps over the scene and 0.1 m before and behind it.
rt::DepthModelParameters cameraOf(SceneNoise noise, double wall_m) {
  constexpr double kBeyond_m = 0.1;
  if (noise != SceneNoise::none) return {};
  return fineDepthModel(wall_m - kBeyond_m, wall_m + kBackground_m + kBeyond_m);
}

/// The half-space behind a wall that faces the camera.
TrueBody wallAt(double depth_m) {
  return ConvexBody{{{{0, 0, 1}, -depth_m}}};
}

/// Along the outward direction of the entry's side: positive beyond the optical axis.
double sideOf(const EntryCase& entry) {
  return entry.kind == EntryKind::visible_side ? -kEdge_m : kEdge_m;
}

BodyScene sceneOf(const EntryCase& entry) {
  std::vector<TrueBody> bodies;
  if (isThroughSide(entry.kind)) {
    bodies = {blockWithSide(entry.side, sideOf(entry), entry.wall_m), wallAt(entry.wall_m + kBackground_m)};
  } else {
    bodies = {wallAt(entry.wall_m)};
  }
  return {bodies, {}, {}, cameraOf(entry.noise, entry.wall_m), entry.seed};
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
    case EntryKind::hidden_side: {
      const Vec3 out = outOf(entry.side);
      const Vec3 on_side = sideOf(entry) * out + kHandRow_m * cross({0, 0, 1}, out) + Vec3{0, 0, level};
      return {on_side + kOutside_m * out, on_side - kInside_m * out};
    }
    case EntryKind::from_behind:
      return {{0.0213, kHandRow_m, -(entry.wall_m + kBehind_m)},
              {0.0213, kHandRow_m, -(entry.wall_m - kFront_m)}};
    case EntryKind::into_image:
      return {at(border + kBorder_m), at(border - kBorder_m)};
    case EntryKind::out_of_image:
      return {at(border - kBorder_m), at(border + kBorder_m)};
  }
  return {};
}

}  // namespace

bool isThroughSide(EntryKind kind) {
  return kind == EntryKind::visible_side || kind == EntryKind::hidden_side;
}

void EntryResult::add(const EntryResult& other) {
  inside += other.inside;
  of_body += other.of_body;
  none_reported += other.none_reported;
  none_silent += other.none_silent;
  wrong += other.wrong;
  ghost_n = std::max(ghost_n, other.ghost_n);
  sideways_n = std::max(sideways_n, other.sideways_n);
  step_n = std::max(step_n, other.step_n);
  early_n = std::max(early_n, other.early_n);
  angle_deg = std::max(angle_deg, other.angle_deg);
}

namespace {

/// Returns the vector between `from` and `to` that is nearest to `v`.
Vec3 nearestBetween(const Vec3& from, const Vec3& to, const Vec3& v) {
  const Vec3 span = to - from;
  const double share = dot(v - from, span) / std::max(dot(span, span), 1e-12);
  return from + std::clamp(share, 0.0, 1.0) * span;
}

}  // namespace

EntryResult judgeEntry(const std::vector<EntryTick>& ticks, double stiffness_n_per_m) {
  EntryResult result;
  double turned_ticks = 0;
  std::optional<std::size_t> entered;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const EntryTick& tick = ticks[i];
    if (i > 0) {
      const double explained_n = stiffness_n_per_m * norm(tick.hip_m - ticks[i - 1].hip_m);
      const double step_n = norm(tick.blended_n - ticks[i - 1].blended_n);
      result.step_n = std::max(result.step_n, step_n - explained_n);
    }
    if (!tick.has_side) result.sideways_n = std::max(result.sideways_n, std::abs(tick.force_n.x));
    if (tick.outside) result.ghost_n = std::max(result.ghost_n, norm(tick.force_n));
    if (!entered && norm(tick.true_n) > 0) entered = i;
    if (entered && i < *entered + kEarly_ticks) result.early_n = std::max(result.early_n, norm(tick.force_n));
    if (!tick.inside) continue;
    ++result.inside;
    // Contact with a side ends where the front is nearer, if it ends.
    const double front_n = norm(tick.front_n);
    const bool front_is_nearer = front_n > 0 && front_n < norm(tick.true_n);
    const bool is_right = isRightForce(tick.force_n, tick.true_n) ||
                          (front_is_nearer && isRightForce(tick.force_n, tick.front_n));
    const double turn_ticks =
        norm(tick.true_n - tick.front_n) / (stiffness_n_per_m * rt::kFastestSurface_m_per_s * kPeriod_s);
    const bool turns = !is_right && front_is_nearer && turned_ticks < turn_ticks &&
                       isRightForce(tick.force_n, nearestBetween(tick.true_n, tick.front_n, tick.force_n));
    if (turns) ++turned_ticks;
    if (!turns && norm(tick.force_n) > kDirection_n) {
      double angle_deg = angleBetween_deg(tick.force_n, tick.true_n);
      if (front_is_nearer) angle_deg = std::min(angle_deg, angleBetween_deg(tick.force_n, tick.front_n));
      result.angle_deg = std::max(result.angle_deg, angle_deg);
    }
    if (norm(tick.force_n) <= kNone_n) {
      ++(tick.state == rt::ContactState::behind ? result.none_reported : result.none_silent);
    } else if (is_right || turns) {
      ++result.of_body;
    } else {
      ++result.wrong;
    }
  }
  return result;
}

EntryResult runEntry(const std::string& law, const EntryCase& entry) {
  const rt::DepthModelParameters camera = cameraOf(entry.noise, entry.wall_m);
  BodyScene scene = sceneOf(entry);
  IdealConstraint ideal(scene);
  const auto box = shippedBox(law, entry.wall_m, camera);
  const double stiffness = box->parameters().force.stiffness_n_per_m;
  FramePlayer player(*box, renderedStream([&](long, std::uint64_t number, rt::DepthFrame& frame) {
    scene.render(0, number, entry.noise, frame);
  }));
  const EntryPath path = pathOf(entry, camera);
  const double length_m = norm(path.to_m - path.from_m);
  const auto moving = std::lround(length_m / (entry.speed_m_per_s * kPeriod_s));
  // a hand that leaves the image presses from the front first
  const bool presses = entry.kind == EntryKind::out_of_image;
  // the image shows no better where the body ends
  const double clear_m = std::max(kClear_m, entry.wall_m / camera.fx_px);
  std::vector<EntryTick> ticks;
  for (long tick = 0; tick < kWait_ticks + moving; ++tick) {
    const double share =
        std::clamp(static_cast<double>(tick - kWait_ticks) / static_cast<double>(moving), 0.0, 1.0);
    Vec3 hip = path.from_m + share * (path.to_m - path.from_m);
    if (presses) {
      const double remaining_m =
          entry.speed_m_per_s * kPeriod_s * static_cast<double>(kWait_ticks - 100 - tick);
      hip.z += std::clamp(remaining_m, 0.0, kFront_m + entry.below_m);
    }
    const auto hold = ideal.follow(hip, 0);
    const rt::Tick now = player.tick(hip);
    if (tick < kWait_ticks) continue;
    const Vec3 to_surface_m = hold ? hold->proxy_m - hip : Vec3{};
    ticks.push_back({.force_n = now.law_force_n_in_world,
                     .blended_n = now.blended_force_n_in_world,
                     .state = now.contact,
                     .hip_m = hip,
                     .inside = norm(to_surface_m) > clear_m,
                     .outside = !hold && scene.signedDistance(hip, 0) > clear_m,
                     .has_side = isThroughSide(entry.kind),
                     .true_n = stiffness * to_surface_m,
                     .front_n = isThroughSide(entry.kind) ? Vec3{0, 0, stiffness * entry.below_m} : Vec3{}});
  }
  return judgeEntry(ticks, stiffness);
}

namespace {

constexpr double kHandFrom_m = 0.03;
constexpr double kHandTo_m = 0.045;  // 22.5 N at 500 N/m
constexpr double kStillBefore_m = 0.02;
constexpr double kSurfaceDisplacement_m = 0.06;
constexpr long kBeforePush_ticks = 700;
constexpr double kPopLimit_n = 20;
constexpr double kKnown_px = 3;  // inside the outline, where the body is certain to be
constexpr double kTwoFrames_s = 2.0 / 30;

rt::DepthModelParameters cameraOf(const BorderPushCase& push) {
  if (push.noise != SceneNoise::none) return {};
  return fineDepthModel(push.wall_m - 0.15, push.wall_m + kBackground_m + 0.05);
}

OccludedSceneParameters bodyOf(const BorderPushCase& push) {
  OccludedSceneParameters body;
  if (push.kind == BorderKind::image_border) return body;
  body.background_m = push.wall_m + kBackground_m;
  (push.kind == BorderKind::silhouette_visible ? body.left_m : body.right_m) = kEdge_m;
  return body;
}

/// Distance of the HIP's ray from the border of the surface in the image, positive on the surface.
double insideOutline_px(const BorderPushCase& push, const Vec3& hip, double wall_m,
                        const rt::DepthModelParameters& camera) {
  const double ray_px = camera.fx_px * hip.x / -hip.z;
  const double edge_px = camera.fx_px * kEdge_m / wall_m;
  switch (push.kind) {
    case BorderKind::silhouette_hidden:
      return edge_px - ray_px;
    case BorderKind::silhouette_visible:
      return ray_px - edge_px;
    case BorderKind::image_border:
      break;
  }
  return drivers::SensorNoise::kFirstDeadColumn - 0.5 - camera.cx_px - ray_px;
}

/// Returns the point at which the hand pushes, at the level of the front.
Vec3 footOf(const BorderPushCase& push, const rt::DepthModelParameters& camera) {
  switch (push.kind) {
    case BorderKind::silhouette_hidden:
      return {kEdge_m - push.beside_m, kHandRow_m, -push.wall_m};
    case BorderKind::silhouette_visible:
      return {kEdge_m + push.beside_m, kHandRow_m, -push.wall_m};
    case BorderKind::image_border:
      break;
  }
  // in sight also where a surface that moves has come nearest
  const double border_px = drivers::SensorNoise::kFirstDeadColumn - 0.5;
  const double border_m = (border_px - camera.cx_px) / camera.fx_px * (push.wall_m - kSurfaceDisplacement_m);
  return {border_m - push.beside_m, kHandRow_m, -push.wall_m};
}

}  // namespace

void BorderPushResult::add(const BorderPushResult& other) {
  pushes += other.pushes;
  popped += other.popped;
  at_outline += other.at_outline;
  least_n = std::min(least_n, other.least_n);
}

BorderPushResult runBorderPush(const std::string& law, const BorderPushCase& push) {
  const rt::DepthModelParameters camera = cameraOf(push);
  OccludedScene scene(bodyOf(push), camera, push.noise, push.seed);
  const auto box = shippedBox(law, push.wall_m, camera);
  const double stiffness = box->parameters().force.stiffness_n_per_m;
  const auto movedBy = [&push](long tick, double most_m) {
    const auto since = static_cast<double>(std::max(0L, tick - kBeforePush_ticks));
    return std::min(most_m, push.speed_m_per_s * kPeriod_s * since);
  };
  const auto wallAt = [&](long tick) {
    return push.wall_m - (push.surface_moves ? movedBy(tick, kSurfaceDisplacement_m) : 0);
  };
  FramePlayer player(*box, renderedStream([&](long tick, std::uint64_t number, rt::DepthFrame& frame) {
    scene.render({.wall_m = wallAt(tick)}, number, frame);
  }));
  const Vec3 foot = footOf(push, camera);
  const double displacement_m = push.surface_moves ? kSurfaceDisplacement_m : kHandFrom_m + kHandTo_m;
  const long end = kBeforePush_ticks + std::lround(displacement_m / push.speed_m_per_s / kPeriod_s);
  std::vector<double> outward_n;
  std::vector<double> ideal_n;
  std::vector<double> inside_px;
  for (long tick = 0; tick < end; ++tick) {
    const double in_front_m =
        push.surface_moves ? kStillBefore_m : kHandFrom_m - movedBy(tick, displacement_m);
    const Vec3 hip = foot + Vec3{0, 0, in_front_m};
    const double force_n = player.tick(hip).law_force_n_in_world.z;
    if (tick < kBeforePush_ticks) continue;
    outward_n.push_back(force_n);
    inside_px.push_back(insideOutline_px(push, hip, wallAt(tick), camera));
    // What the law can know: the surface comes on for up to two frames before it is seen there.
    const double unseen_m = push.surface_moves ? push.speed_m_per_s * kTwoFrames_s : 0;
    ideal_n.push_back(stiffness * std::max(0.0, -hip.z - wallAt(tick) - unseen_m));
  }
  const PopThrough judged = judgePush(outward_n, ideal_n);
  BorderPushResult result{.pushes = 1, .least_n = judged.largest_n};
  if (!judged.under(kPopLimit_n)) return result;
  // it lets go after its largest force, when the ray may already be nearer
  ++(inside_px[judged.largest_tick] >= kKnown_px ? result.popped : result.at_outline);
  return result;
}

namespace {

constexpr double kOutline_m_per_s = 0.1;
constexpr double kPressed_m = 0.008;
constexpr double kFree_m = 0.02;        // where the hand begins, before the front
constexpr double kBesideEdge_m = 0.02;  // of the hand, where the body moves aside
constexpr double kAside_m = 0.04;       // that the body moves
constexpr double kBeyondPass_m = 0.01;  // how much farther a body comes on than to where its outline passes
// So far from the optical axis, per metre of depth, is a side whose outline passes over a hand while the
// surface comes on: with a pixel of 1.7 mm at 1 m, 6 mm on are one pixel.
constexpr double kSideOverDepth = 0.3;
constexpr long kPress_ticks = 600;
constexpr long kBeforeMotion_ticks = 1000;
constexpr long kAfterMotion_ticks = 300;

bool comesOn(const OutlineCase& outline) {
  return outline.motion == OutlineMotion::comes_on;
}

/// Along the outward direction of the side.
double sideOf(const OutlineCase& outline) {
  if (comesOn(outline)) return -kSideOverDepth * outline.wall_m;
  return outline.visible ? -kEdge_m : kEdge_m;
}

double travel_m(const OutlineCase& outline) {
  return comesOn(outline) ? outline.passes_at_m - kPressed_m + kBeyondPass_m : kAside_m;
}

BodyScene sceneOf(const OutlineCase& outline) {
  // The wall moves with the block, along itself or towards the camera.
  BodyMotion motion;
  motion.start_s = kBeforeMotion_ticks * kPeriod_s;
  motion.velocity_m_per_s = kOutline_m_per_s * (comesOn(outline) ? Vec3{0, 0, 1} : -outOf(outline.side));
  return {
      {blockWithSide(outline.side, sideOf(outline), outline.wall_m), wallAt(outline.wall_m + kBackground_m)},
      {},
      motion,
      cameraOf(outline.noise, outline.wall_m),
      outline.seed};
}

/// The place on the front that the hand presses.
Vec3 footOf(const OutlineCase& outline) {
  const double hip_depth_m = outline.wall_m + kPressed_m;
  double beside_m = kBesideEdge_m;
  if (comesOn(outline)) {
    // where the ray to the HIP goes past the side's edge when that has come as near as it is to
    const double side_m = std::abs(sideOf(outline));
    beside_m = side_m * hip_depth_m / (hip_depth_m - outline.passes_at_m) - side_m;
  }
  const Vec3 out = outOf(outline.side);
  return (sideOf(outline) - beside_m) * out + kHandRow_m * cross({0, 0, 1}, out) +
         Vec3{0, 0, -outline.wall_m};
}

}  // namespace

void OutlineResult::add(const OutlineResult& other) {
  runs += other.runs;
  not_pressed += other.not_pressed;
  held += other.held;
  drop_n = std::max(drop_n, other.drop_n);
  fewest_frames = std::min(fewest_frames, other.fewest_frames);
}

namespace {

constexpr double kHigh = 0.9;
constexpr double kHalf = 0.5;
constexpr double kLow = 0.1;
constexpr double kTicksOfFrame = 1000.0 / 30;
constexpr std::ptrdiff_t kLongest_ticks = 334;  // ten frames
constexpr double kNothing_n = 0.25;             // half a millimetre: what noise makes of a force near zero

/// The largest force of up to ten frames before `tick`, which is not the first.
double largestBefore_n(const std::vector<double>& force_n, std::size_t tick) {
  const auto now = force_n.begin() + static_cast<std::ptrdiff_t>(tick);
  return *std::max_element(std::max(force_n.begin(), now - kLongest_ticks), now);
}

/// In how many frames the force fell that is, at `tick`, down to 10 % of the largest one before, or to half
/// of it where it falls no farther; nothing where it does neither.
std::optional<double> framesOfFall(const std::vector<double>& force_n, std::size_t tick) {
  const double largest_n = largestBefore_n(force_n, tick);
  if (largest_n < kNothing_n) return std::nullopt;
  std::size_t high = tick - 1;
  const auto frames = [&] {
    while (force_n[high] < kHigh * largest_n) --high;
    return static_cast<double>(tick - high) / kTicksOfFrame;
  };
  if (force_n[tick] <= kLow * largest_n) return frames();
  if (force_n[tick] > kHalf * largest_n || force_n[tick - 1] <= kHalf * largest_n) return std::nullopt;
  const auto now = force_n.begin() + static_cast<std::ptrdiff_t>(tick);
  const auto later = now + std::min(kLongest_ticks, force_n.end() - now);
  if (*std::min_element(now, later) <= kLow * largest_n) return std::nullopt;
  // at that speed, from 90 to 10 %
  return frames() * (kHigh - kLow) / (kHigh - kHalf);
}

}  // namespace

OutlineResult judgeOutline(const std::vector<double>& force_n, double before_n) {
  constexpr double kPressedShare = 0.5;
  OutlineResult result{.runs = 1};
  if (force_n.empty() || force_n.front() < kPressedShare * before_n) {
    result.not_pressed = 1;
    return result;
  }
  for (std::size_t tick = 1; tick < force_n.size(); ++tick) {
    result.drop_n = std::max(result.drop_n, force_n[tick - 1] - force_n[tick]);
    if (const auto frames = framesOfFall(force_n, tick))
      result.fewest_frames = std::min(result.fewest_frames, *frames);
  }
  result.held = force_n.back() > kHalf * *std::ranges::max_element(force_n) ? 1 : 0;
  return result;
}

OutlineResult runOutline(const std::string& law, const OutlineCase& outline) {
  const rt::DepthModelParameters camera = cameraOf(outline.noise, outline.wall_m);
  BodyScene scene = sceneOf(outline);
  const auto box = shippedBox(law, outline.wall_m, camera);
  const double true_n = kPressed_m * box->parameters().force.stiffness_n_per_m;
  const double moves_s = travel_m(outline) / kOutline_m_per_s;
  const double stops_s = kBeforeMotion_ticks * kPeriod_s + moves_s;
  FramePlayer player(*box, renderedStream([&](long tick, std::uint64_t number, rt::DepthFrame& frame) {
    const double t_s = static_cast<double>(tick) * kPeriod_s;
    scene.render(std::min(t_s, stops_s), number, outline.noise, frame);
  }));
  const Vec3 foot = footOf(outline);
  const long end = kBeforeMotion_ticks + std::lround(moves_s / kPeriod_s) + kAfterMotion_ticks;
  std::vector<double> force_n;
  for (long tick = 0; tick < end; ++tick) {
    const double pressed_m =
        kOutline_m_per_s * kPeriod_s * static_cast<double>(std::max(0L, tick - kPress_ticks));
    const Vec3 hip = foot + Vec3{0, 0, std::max(kFree_m - pressed_m, -kPressed_m)};
    const double now_n = norm(player.tick(hip).law_force_n_in_world);
    if (tick >= kBeforeMotion_ticks) force_n.push_back(now_n);
  }
  return judgeOutline(force_n, true_n);
}

}  // namespace hapticd::tools
