// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/occlusion.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kSpeed_m_per_s = 0.1;
constexpr double kPeriod_s = 0.001;
constexpr double kPressed_m = 0.008;
constexpr double kFree_m = 0.02;  // where the hand begins, before the front
constexpr double kBackground_m = 0.35;
constexpr double kNear_m = 0.1;         // of what the camera without noise measures, before the front
constexpr double kBesideEdge_m = 0.02;  // of the hand, where the body moves aside
constexpr double kAside_m = 0.04;       // that the body moves
constexpr double kBeyondPass_m = 0.01;  // how much farther a body comes on than to where its outline passes
// So far from the optical axis, per metre of depth, is a side whose outline passes over a hand while the
// surface comes on: with a pixel of 1.7 mm at 1 m, 6 mm on are one pixel.
constexpr double kSideOverDepth = 0.3;
constexpr double kSide_m = 0.1;
constexpr double kAcross_m = 0.0117;
constexpr long kPress_ticks = 600;
constexpr long kBeforeMotion_ticks = 1000;
constexpr long kAfterMotion_ticks = 300;

rt::DepthModelParameters cameraOf(const OutlineCase& outline) {
  if (outline.noise != SceneNoise::none) return {};
  return fineDepthModel(outline.wall_m - kNear_m, outline.wall_m + kBackground_m + kNear_m);
}

bool comesOn(const OutlineCase& outline) {
  return outline.motion == OutlineMotion::comes_on;
}

/// Along the outward direction of the side.
double sideOf(const OutlineCase& outline) {
  if (comesOn(outline)) return -kSideOverDepth * outline.wall_m;
  return outline.visible ? -kSide_m : kSide_m;
}

double travel_m(const OutlineCase& outline) {
  return comesOn(outline) ? outline.passes_at_m - kPressed_m + kBeyondPass_m : kAside_m;
}

BodyScene sceneOf(const OutlineCase& outline) {
  // The wall moves with the block, along itself or towards the camera.
  const TrueBody wall = ConvexBody{{{{0, 0, 1}, -(outline.wall_m + kBackground_m)}}};
  BodyMotion motion;
  motion.start_s = kBeforeMotion_ticks * kPeriod_s;
  motion.velocity_m_per_s = kSpeed_m_per_s * (comesOn(outline) ? Vec3{0, 0, 1} : -outOf(outline.side));
  return {{blockWithSide(outline.side, sideOf(outline), outline.wall_m), wall},
          {},
          motion,
          cameraOf(outline),
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
  return (sideOf(outline) - beside_m) * out + kAcross_m * cross({0, 0, 1}, out) + Vec3{0, 0, -outline.wall_m};
}

}  // namespace

std::string_view nameOf(OutlineMotion motion) {
  constexpr std::array<std::string_view, 2> kNames{"moves aside", "comes on"};
  return kNames.at(static_cast<std::size_t>(motion));
}

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
  const rt::DepthModelParameters camera = cameraOf(outline);
  BodyScene scene = sceneOf(outline);
  const auto box = shippedBox(law, outline.wall_m, camera);
  const double true_n = kPressed_m * box->parameters().force.stiffness_n_per_m;
  const double moves_s = travel_m(outline) / kSpeed_m_per_s;
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
        kSpeed_m_per_s * kPeriod_s * static_cast<double>(std::max(0L, tick - kPress_ticks));
    const Vec3 hip = foot + Vec3{0, 0, std::max(kFree_m - pressed_m, -kPressed_m)};
    const double now_n = norm(player.tick(hip).law_force_n_in_world);
    if (tick >= kBeforeMotion_ticks) force_n.push_back(now_n);
  }
  return judgeOutline(force_n, true_n);
}

}  // namespace hapticd::tools
