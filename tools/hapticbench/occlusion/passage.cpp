#include "tools/hapticbench/occlusion/passage.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/shipped_law.h"
#include "tools/truth/fine_depth_model.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kGhostLimit_n = 0.1;
constexpr double kErrorLimit_n = 0.5;
constexpr double kLostShare = 0.1;
constexpr double kFree_m = 0.03;
constexpr double kPress_m = 0.006;
constexpr double kStroke_m = 0.008;
constexpr double kStrokeReach_m = 0.04;
constexpr double kHand_m_per_tick = 1e-4;  // 0.1 m/s
constexpr double kTick_s = 0.001;
constexpr long kSettleTicks = 1200;   // the law has seen the wall and the hand is where it is to be
constexpr long kBaselineTicks = 300;  // of these, the last
constexpr double kStart_m = 0.4;      // from the line of sight to the body's middle at the start
constexpr long kAfterTicks = 500;
// off the lattice of pixels, and where neither column nor row is in the middle
constexpr Vec3 kHandPlace_m{0.0213, 0.0117, 0};

/// Where the body is and what the hand does, tick by tick.
class PassageScript {
 public:
  explicit PassageScript(const PassageCase& passage) : case_(passage) {
    const double hip_depth = passage.wall_m - kFree_m;
    back_m_ = hip_depth - passage.gap_m;
    const double speed = std::abs(passage.speed_m_per_s);
    const double middle_depth = back_m_ - passage.thickness_m / 2;
    sight_x_m_ = kHandPlace_m.x * middle_depth / hip_depth;
    arrives_ = kSettleTicks + std::lround(kStart_m / speed / kTick_s);
    leaves_ = arrives_ + std::lround(passage.pause_s / kTick_s);
    end_ = leaves_ + std::lround(kStart_m / speed / kTick_s) + kAfterTicks;
  }

  double back_m() const { return back_m_; }
  long end() const { return end_; }

  double bodyX_m(long tick) const {
    const double since_s = static_cast<double>(std::clamp(tick, kSettleTicks, arrives_) - arrives_ +
                                               std::clamp(tick, leaves_, end_) - leaves_) *
                           kTick_s;
    return sight_x_m_ + case_.speed_m_per_s * since_s;
  }

  /// How deep behind the wall's front.
  double depth_m(long tick) const {
    const auto moveTo = [](long since, double from_m, double to_m) {
      const double way = kHand_m_per_tick * static_cast<double>(std::max(since, 0L));
      return from_m < to_m ? std::min(from_m + way, to_m) : std::max(from_m - way, to_m);
    };
    switch (case_.hand) {
      case HandDuringPassage::free:
        return -kFree_m;
      case HandDuringPassage::pressing:
        return moveTo(tick - kSettleTicks / 2, -kFree_m, kPress_m);
      case HandDuringPassage::stroking:
        return moveTo(tick - kSettleTicks / 2, -kFree_m, kStroke_m);
      case HandDuringPassage::entering:
        return moveTo(tick - arrives_, -kFree_m, kPress_m);
      case HandDuringPassage::leaving:
        return tick < arrives_ ? moveTo(tick - kSettleTicks / 2, -kFree_m, kPress_m)
                               : moveTo(tick - arrives_, kPress_m, -kFree_m);
    }
    return -kFree_m;
  }

  Vec3 hip_m(long tick) const {
    Vec3 hip = kHandPlace_m + Vec3{0, 0, -(case_.wall_m + depth_m(tick))};
    if (case_.hand != HandDuringPassage::stroking) return hip;
    const auto period = std::lround(4 * kStrokeReach_m / kHand_m_per_tick);
    const double share = static_cast<double>(tick % period) / static_cast<double>(period);
    hip.y += 4 * kStrokeReach_m * (std::abs(share - 0.5) - 0.25);
    return hip;
  }

 private:
  const PassageCase& case_;
  double back_m_;
  double sight_x_m_;
  long arrives_;
  long leaves_;
  long end_;
};

rt::DepthModelParameters cameraFor(const PassageCase& passage, const PassageScript& script) {
  constexpr double kMargin_m = 0.06;
  const rt::DepthModelParameters kinect;
  if (passage.noise != SceneNoise::none) return kinect;
  return fineDepthModel(script.back_m() - passage.thickness_m - kMargin_m, passage.wall_m + kMargin_m);
}

}  // namespace

std::string_view nameOf(HandDuringPassage hand) {
  constexpr std::array<std::string_view, 5> kNames{"free", "pressing", "stroking", "entering", "leaving"};
  return kNames.at(static_cast<std::size_t>(hand));
}

std::string_view nameOf(OccluderShape shape) {
  constexpr std::array<std::string_view, 3> kNames{"none", "box", "cylinder"};
  return kNames.at(static_cast<std::size_t>(shape));
}

void PassageResult::add(const PassageResult& other) {
  ghost.add(other.ghost);
  error.add(other.error);
  disturbance.add(other.disturbance);
  pressed += other.pressed;
  lost += other.lost;
}

PassageResult judgePassage(const std::vector<PassageTick>& before, const std::vector<PassageTick>& during) {
  Vec3 usual;
  for (const PassageTick& tick : before) usual += (1.0 / static_cast<double>(before.size())) * tick.force_n;
  PassageResult result;
  std::vector<double> ghosts;
  std::vector<double> errors;
  std::vector<double> disturbances;
  for (const PassageTick& tick : during) {
    if (tick.true_n == Vec3{}) {
      ghosts.push_back(norm(tick.force_n));
      continue;
    }
    ++result.pressed;
    errors.push_back(norm(tick.force_n - tick.true_n));
    disturbances.push_back(norm(tick.force_n - usual));
    if (norm(tick.force_n) < kLostShare * norm(tick.true_n)) ++result.lost;
  }
  result.ghost = exceedance(ghosts, kGhostLimit_n);
  result.error = exceedance(errors, kErrorLimit_n);
  result.disturbance = exceedance(disturbances, kErrorLimit_n);
  return result;
}

PassageResult runPassage(config::LawChoice law, const PassageCase& passage) {
  const PassageScript script(passage);
  const rt::DepthModelParameters camera = cameraFor(passage, script);
  OccludedScene scene({.occluder = passage.shape,
                       .thickness_m = passage.thickness_m,
                       .back_m = script.back_m(),
                       .projector_shadow = passage.projector_shadow},
                      camera, passage.seed);
  const auto box = shippedBox(law, passage.wall_m, camera);
  const double stiffness = box->parameters().springs.stiffness_n_per_m;
  std::array<std::unique_ptr<rt::DepthFrame>, 2> frames{std::make_unique<rt::DepthFrame>(),
                                                        std::make_unique<rt::DepthFrame>()};
  FramePlayer player(*box, {[&](int index) -> const rt::DepthFrame& {
                              rt::DepthFrame& frame = *frames[static_cast<std::size_t>(index % 2)];
                              const long tick = tickOfRegularFrame(index);
                              scene.render({passage.wall_m, script.bodyX_m(tick)},
                                           static_cast<std::uint64_t>(index) + 1, passage.noise, frame);
                              frame.arrival_ns = tick * 1'000'000;
                              return frame;
                            },
                            tickOfRegularFrame});
  std::vector<PassageTick> before;
  std::vector<PassageTick> during;
  for (long tick = 0; tick < script.end(); ++tick) {
    const Vec3 force_n = player.tick(script.hip_m(tick)).law_force_n_in_world;
    const Vec3 true_n{0, 0, stiffness * std::max(0.0, script.depth_m(tick))};
    if (tick >= kSettleTicks) {
      during.push_back({force_n, true_n});
    } else if (tick >= kSettleTicks - kBaselineTicks) {
      before.push_back({force_n, true_n});
    }
  }
  return judgePassage(before, during);
}

}  // namespace hapticd::tools
