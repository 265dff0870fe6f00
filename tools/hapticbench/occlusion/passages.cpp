// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/occlusion/occlusion.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kGhostLimit_n = 0.1;
constexpr double kErrorLimit_n = 0.5;
constexpr double kLostShare = 0.1;
constexpr double kSameTruth_n = 1e-6;
constexpr double kFree_m = 0.03;
constexpr double kPress_m = 0.006;
constexpr double kStroke_m = 0.008;
constexpr double kStrokeReach_m = 0.04;
constexpr double kHand_m_per_tick = 1e-4;  // 0.1 m/s
constexpr double kTick_s = 0.001;
constexpr long kSettleTicks = 1200;   // the law has seen the wall and the hand is where it is to be
constexpr long kBaselineTicks = 200;  // of these, the last
constexpr double kStart_m = 0.25;     // from the line of sight to the body's middle at the start
constexpr long kAfterTicks = 500;
// off the lattice of pixels, and where neither column nor row is in the middle
constexpr Vec3 kHandPlace_m{0.0213, 0.0117, 0};

/// Depth of the back of the body that passes.
double backOf(const PassageCase& passage) {
  return passage.wall_m - kFree_m - passage.gap_m;
}

rt::DepthModelParameters cameraFor(const PassageCase& passage) {
  constexpr double kMargin_m = 0.06;
  if (passage.noise != SceneNoise::none) return {};
  return fineDepthModel(backOf(passage) - passage.thickness_m - kMargin_m, passage.wall_m + kMargin_m);
}

OccludedScene sceneFor(const PassageCase& passage) {
  return {{.occluder = passage.shape,
           .thickness_m = passage.thickness_m,
           .back_m = backOf(passage),
           .projector_shadow = passage.projector_shadow},
          cameraFor(passage),
          passage.noise,
          passage.seed};
}

/// Returns the position of a hand that started `ticks` ago to move from one position to another.
double movedSince(long ticks, double from_m, double to_m) {
  const double displacement_m = kHand_m_per_tick * static_cast<double>(std::max(ticks, 0L));
  return from_m < to_m ? std::min(from_m + displacement_m, to_m) : std::max(from_m - displacement_m, to_m);
}

}  // namespace

void PassageResult::add(const PassageResult& other) {
  ghost.add(other.ghost);
  error.add(other.error);
  change.add(other.change);
  pressed += other.pressed;
  lost += other.lost;
}

PassageResult judgePassage(const std::vector<PassageTick>& before, const std::vector<PassageTick>& during) {
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(before.size(), 1));
  Vec3 usual_n;
  Vec3 usual_true_n;
  for (const PassageTick& tick : before) {
    usual_n += share * tick.force_n;
    usual_true_n += share * tick.true_n;
  }
  PassageResult result;
  std::vector<double> ghosts;
  std::vector<double> errors;
  std::vector<double> changes;
  for (const PassageTick& tick : during) {
    if (tick.true_n == Vec3{}) {
      ghosts.push_back(norm(tick.force_n));
      continue;
    }
    ++result.pressed;
    errors.push_back(norm(tick.force_n - tick.true_n));
    const bool as_before = norm(tick.true_n - usual_true_n) < kSameTruth_n;
    if (as_before) changes.push_back(norm(tick.force_n - usual_n));
    if (norm(tick.force_n) < kLostShare * norm(tick.true_n)) ++result.lost;
  }
  result.ghost = exceedance(ghosts, kGhostLimit_n);
  result.error = exceedance(errors, kErrorLimit_n);
  result.change = exceedance(changes, kErrorLimit_n);
  return result;
}

Passage::Passage(const PassageCase& passage)
    : case_(passage), back_m_(backOf(passage)), scene_(sceneFor(passage)) {
  const double hip_depth_m = passage.wall_m - kFree_m;
  const double approach_s = kStart_m / std::abs(passage.speed_m_per_s);
  sight_x_m_ = kHandPlace_m.x * (back_m_ - passage.thickness_m / 2) / hip_depth_m;
  arrives_ = kSettleTicks + std::lround(approach_s / kTick_s);
  leaves_ = arrives_ + std::lround(passage.pause_s / kTick_s);
  end_ = leaves_ + std::lround(approach_s / kTick_s) + kAfterTicks;
}

double Passage::bodyX_m(long tick) const {
  const long to_come = arrives_ - std::clamp(tick, kSettleTicks, arrives_);
  const long gone = std::clamp(tick, leaves_, end_) - leaves_;
  return sight_x_m_ + case_.speed_m_per_s * kTick_s * static_cast<double>(gone - to_come);
}

double Passage::depth_m(long tick) const {
  constexpr long kPushTick = kSettleTicks / 2;
  switch (case_.hand) {
    case HandDuringPassage::free:
      return -kFree_m;
    case HandDuringPassage::pressing:
      return movedSince(tick - kPushTick, -kFree_m, kPress_m);
    case HandDuringPassage::stroking:
      return movedSince(tick - kPushTick, -kFree_m, kStroke_m);
    case HandDuringPassage::entering:
      return movedSince(tick - arrives_, -kFree_m, kPress_m);
    case HandDuringPassage::leaving:
      return tick < arrives_ ? movedSince(tick - kPushTick, -kFree_m, kPress_m)
                             : movedSince(tick - arrives_, kPress_m, -kFree_m);
  }
  return -kFree_m;
}

Vec3 Passage::hip_m(long tick) const {
  Vec3 hip = kHandPlace_m + Vec3{0, 0, -(case_.wall_m + depth_m(tick))};
  if (case_.hand != HandDuringPassage::stroking) return hip;
  const long period = std::lround(4 * kStrokeReach_m / kHand_m_per_tick);
  const double share = static_cast<double>(tick % period) / static_cast<double>(period);
  hip.y += 4 * kStrokeReach_m * (std::abs(share - 0.5) - 0.25);
  return hip;
}

const rt::DepthFrame& Passage::frame(int index) {
  const auto place = static_cast<std::size_t>(index);
  if (place >= frames_.size()) frames_.resize(place + 1);
  if (!frames_[place]) {
    frames_[place] = std::make_unique<rt::DepthFrame>();
    const long tick = tickOfRegularFrame(index);
    scene_.render({case_.wall_m, bodyX_m(tick)}, place + 1, *frames_[place]);
    frames_[place]->arrival_ns = tick * 1'000'000;
  }
  return *frames_[place];
}

PassageResult Passage::run(const std::string& law) {
  const auto box = shippedBox(law, case_.wall_m, scene_.camera());
  const double stiffness = box->parameters().force.stiffness_n_per_m;
  FramePlayer player(
      *box, {[this](int index) -> const rt::DepthFrame& { return frame(index); }, tickOfRegularFrame});
  std::vector<PassageTick> before;
  std::vector<PassageTick> during;
  for (long tick = 0; tick < end_; ++tick) {
    const Vec3 force_n = player.tick(hip_m(tick)).law_force_n_in_world;
    const Vec3 true_n{0, 0, stiffness * std::max(0.0, depth_m(tick))};
    if (tick >= kSettleTicks) {
      during.push_back({force_n, true_n});
    } else if (tick >= kSettleTicks - kBaselineTicks) {
      before.push_back({force_n, true_n});
    }
  }
  return judgePassage(before, during);
}

namespace {

constexpr double kStartBeyond_m = 0.05;  // from the near limit
constexpr double kEndBefore_m = 0.03;
constexpr long kSettle_ticks = 700;
constexpr long kPause_ticks = 2000;
constexpr long kAfter_ticks = 700;

/// Depth of a wall that approaches, waits and goes back.
class WallMotion {
 public:
  WallMotion(double near_m, double speed_m_per_s)
      : near_m_(near_m),
        speed_(speed_m_per_s),
        moving_(std::lround((kStartBeyond_m + kEndBefore_m) / speed_m_per_s / kTick_s)) {}

  double depth_m(long tick) const {
    const long coming = std::clamp(tick - kSettle_ticks, 0L, moving_);
    const long going = std::clamp(tick - kSettle_ticks - moving_ - kPause_ticks, 0L, moving_);
    return near_m_ + kStartBeyond_m - speed_ * kTick_s * static_cast<double>(coming - going);
  }
  long end() const { return kSettle_ticks + 2 * moving_ + kPause_ticks + kAfter_ticks; }

 private:
  double near_m_;
  double speed_;
  long moving_;
};

}  // namespace

NearLimitResult judgeNearLimit(const std::vector<NearLimitTick>& ticks, std::size_t too_near,
                               std::size_t back) {
  constexpr double kHeldShare = 0.5;
  constexpr double kReleasedShare = 0.05;
  NearLimitResult result = NearLimitResult::none();
  result.force_n = ticks[too_near - 1].outward_n;
  result.least_held_n = result.force_n;
  bool held = true;
  for (std::size_t i = too_near; i < back; ++i) {
    const double outward_n = ticks[i].outward_n;
    const auto since_ms = static_cast<double>(i - too_near);
    held = held && outward_n >= kHeldShare * result.force_n;
    if (held) {
      result.held_ms = since_ms + 1;
      result.least_held_n = std::min(result.least_held_n, outward_n);
    }
    if (result.released_ms < 0 && outward_n < kReleasedShare * result.force_n) result.released_ms = since_ms;
    result.largest_step_n = std::max(result.largest_step_n, std::abs(outward_n - ticks[i - 1].outward_n));
    result.cause_named = result.cause_named || ticks[i].cause == rt::Cause::surface_too_near;
  }
  for (std::size_t i = back; i < ticks.size(); ++i)
    result.came_back = result.came_back || ticks[i].outward_n >= kHeldShare * result.force_n;
  return result;
}

NearLimitResult runNearLimit(const std::string& law, double speed_m_per_s) {
  const rt::DepthModelParameters camera;
  OccludedScene scene({}, camera, SceneNoise::quantised, 1);
  const WallMotion wall(camera.near_m, speed_m_per_s);
  const auto box = shippedBox(law, camera.near_m, camera);
  bool measured = true;
  FramePlayer player(*box, renderedStream([&](long tick, std::uint64_t number, rt::DepthFrame& frame) {
    scene.render({.wall_m = wall.depth_m(tick)}, number, frame);
    measured = wall.depth_m(tick) >= camera.near_m;
  }));
  const rt::Vec3 hip{0.0213, 0.0117, -(camera.near_m + kPress_m)};
  std::vector<NearLimitTick> ticks;
  std::size_t too_near = 0;
  std::size_t back = 0;
  for (long tick = 0; tick < wall.end(); ++tick) {
    const rt::Tick now = player.tick(hip);
    if (!measured && too_near == 0) too_near = ticks.size();
    if (measured && too_near > 0 && back == 0) back = ticks.size();
    ticks.push_back({now.command_force_n_in_world.z, now.cause});
  }
  return too_near > 0 && back > too_near ? judgeNearLimit(ticks, too_near, back) : NearLimitResult::none();
}

}  // namespace hapticd::tools
