// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/surface_error.h"

#include <algorithm>

#include "tools/hapticbench/frame_player.h"
#include "tools/hapticbench/law_setting.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kLostShare = 0.1;

bool isStill(const StrokeTick& tick) {
  return tick.along == Vec3{};
}

}  // namespace

void SurfaceError::add(const SurfaceError& other) {
  error_n.insert(error_n.end(), other.error_n.begin(), other.error_n.end());
  along_n.insert(along_n.end(), other.along_n.begin(), other.along_n.end());
  new_frame_n.insert(new_frame_n.end(), other.new_frame_n.begin(), other.new_frame_n.end());
  lost += other.lost;
  zero += other.zero;
  largest_true_n = std::max(largest_true_n, other.largest_true_n);
}

SurfaceError judgeSurface(std::span<const StrokeTick> ticks, std::span<const Vec3> forces_n,
                          const std::vector<bool>& new_frame) {
  SurfaceError result;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const StrokeTick& tick = ticks[i];
    if (!tick.presses) continue;
    const double true_n = norm(tick.true_force_n);
    result.error_n.push_back(norm(forces_n[i] - tick.true_force_n));
    if (dot(forces_n[i], tick.normal) < kLostShare * true_n) ++result.lost;
    if (norm(forces_n[i]) == 0) ++result.zero;
    result.largest_true_n = std::max(result.largest_true_n, true_n);
    if (!isStill(tick)) result.along_n.push_back(dot(forces_n[i], tick.along));
    if (isStill(tick) && new_frame[i]) result.new_frame_n.push_back(norm(forces_n[i] - forces_n[i - 1]));
  }
  return result;
}

SurfaceError handleWith(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                        const CameraDisparity& camera, Handling handling) {
  const auto box = shippedBox(law, surface.distance_m, session.camera());
  const auto ticks = handleSurface(surface, camera, handling, box->parameters().springs.stiffness_n_per_m);
  PlayedSession played(session);
  FramePlayer player(*box, played.stream());
  std::vector<Vec3> forces_n;
  std::vector<bool> new_frame;
  for (const StrokeTick& tick : ticks) {
    forces_n.push_back(player.tick(tick.hip_m).law_force_n_in_world);
    new_frame.push_back(player.frameIsNew());
  }
  return judgeSurface(ticks, forces_n, new_frame);
}

}  // namespace hapticd::tools
