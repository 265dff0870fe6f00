// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/passage.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/lib/truth/fine_depth_model.h"

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

std::string_view nameOf(HandDuringPassage hand) {
  constexpr std::array<std::string_view, 5> kNames{"free", "pressing", "stroking", "entering", "leaving"};
  return kNames.at(static_cast<std::size_t>(hand));
}

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
  const double stiffness = box->parameters().springs.stiffness_n_per_m;
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

}  // namespace hapticd::tools
