// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/near_limit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {
namespace {

constexpr double kStartBeyond_m = 0.05;  // from the near limit
constexpr double kEndBefore_m = 0.03;
constexpr double kPressed_m = 0.006;
constexpr long kSettle_ticks = 700;
constexpr long kPause_ticks = 2000;
constexpr long kAfter_ticks = 700;
constexpr double kPeriod_s = 0.001;

/// Depth of a wall that approaches, waits and goes back.
class WallMotion {
 public:
  WallMotion(double near_m, double speed_m_per_s)
      : near_m_(near_m),
        speed_(speed_m_per_s),
        moving_(std::lround((kStartBeyond_m + kEndBefore_m) / speed_m_per_s / kPeriod_s)) {}

  double depth_m(long tick) const {
    const long coming = std::clamp(tick - kSettle_ticks, 0L, moving_);
    const long going = std::clamp(tick - kSettle_ticks - moving_ - kPause_ticks, 0L, moving_);
    return near_m_ + kStartBeyond_m - speed_ * kPeriod_s * static_cast<double>(coming - going);
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
  const rt::Vec3 hip{0.0213, 0.0117, -(camera.near_m + kPressed_m)};
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
