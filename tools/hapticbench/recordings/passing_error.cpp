// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/passing_error.h"

#include <algorithm>
#include <cmath>

#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/law_setting.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kGhost_n = 0.1;
constexpr double kWrong_n = 0.5;
constexpr double kNear_m = 0.02;
constexpr long kEnterTick = 150;  // the law has seen five frames
constexpr double kEnter_m_per_tick = 2e-4;
constexpr double kWaitBefore_m = 0.03;
constexpr long kCountFromTick = 450;  // in sight until then
constexpr long kAfterCover_ticks = 200;

}  // namespace

void PassingError::add(const PassingError& other) {
  left_out += other.left_out;
  ghost.add(other.ghost);
  ghost_covered.add(other.ghost_covered);
  error.add(other.error);
  change.add(other.change);
  calm.add(other.calm);
}

PassingError judgePassing(const std::vector<PassingTick>& ticks) {
  PassingError result;
  const bool presses =
      std::ranges::any_of(ticks, [](const PassingTick& tick) { return !(tick.true_n == Vec3{}); });
  Vec3 sum_n;
  double calm_ticks = 0;
  for (const PassingTick& tick : ticks) {
    if (tick.covered || tick.left_out) continue;
    sum_n += tick.force_n;
    calm_ticks += 1;
  }
  const Vec3 usual_n = calm_ticks > 0 ? (1 / calm_ticks) * sum_n : Vec3{};
  std::vector<double> ghosts, ghosts_covered, errors, changes, calm_changes;
  for (const PassingTick& tick : ticks) {
    if (tick.left_out) {
      ++result.left_out;
      // it ends a run
      errors.push_back(0);
      changes.push_back(0);
    } else if (!presses) {
      ghosts.push_back(norm(tick.force_n));
      if (tick.covered) ghosts_covered.push_back(norm(tick.force_n));
    } else {
      errors.push_back(tick.covered ? norm(tick.force_n - tick.true_n) : 0);
      const double change_n = norm(tick.force_n - usual_n);
      changes.push_back(tick.covered ? change_n : 0);
      calm_changes.push_back(tick.covered ? 0 : change_n);
    }
  }
  result.ghost = exceedance(ghosts, kGhost_n);
  result.ghost_covered = exceedance(ghosts_covered, kGhost_n);
  if (presses) {
    result.error = exceedance(errors, kWrong_n);
    result.change = exceedance(changes, kWrong_n);
    result.calm = exceedance(calm_changes, kWrong_n);
  }
  return result;
}

PassingError passPlace(const std::string& law, const BenchSequence& session, const PassedPlace& place,
                       const CameraDisparity& camera, double before_m) {
  const auto box = shippedBox(law, place.distance_m, session.camera());
  const double stiffness = box->parameters().springs.stiffness_n_per_m;
  const int first = longestInSight(place.covered).first;
  PlayedSession played(session, first);
  FramePlayer player(*box, played.stream());
  const long end = played.arrivalTick(2 * static_cast<int>(session.frames.size()) - 2);
  // a measurement this much before the surface is not the surface
  const double noise_unit_m = camera.model().noiseUnit_m(place.distance_m);
  const double apart_m = before_m > 0 ? -1 : std::max(0.008, 2.5 * noise_unit_m);
  std::vector<PassingTick> ticks;
  long covered_until = -1;
  bool near = false;
  for (long tick = 0; tick < end; ++tick) {
    const double displacement_m = kEnter_m_per_tick * static_cast<double>(std::max(0L, tick - kEnterTick));
    const double front_m = std::max(before_m, kWaitBefore_m - displacement_m);
    const Vec3 hip = place.point.position_m + front_m * place.point.normal;
    PassingTick now{.force_n = player.tick(hip).law_force_n_in_world,
                    .true_n = stiffness * std::max(0.0, -front_m) * place.point.normal};
    const auto frame = static_cast<std::size_t>(played.frameOfSession(player.frame()));
    if (place.covered[frame]) covered_until = tick + kAfterCover_ticks;
    if (player.frameIsNew())
      near = measuresNear(*session.frames[frame], camera, place, hip, kNear_m, apart_m);
    now.covered = tick <= covered_until;
    now.left_out = near;
    if (tick >= kCountFromTick) ticks.push_back(now);
  }
  return judgePassing(ticks);
}

}  // namespace hapticd::tools
