// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/offline/offline_box.h"

#include <cmath>
#include <utility>

#include "rt/base/realtime_thread.h"

namespace hapticd::tools {

OfflineBox::OfflineBox(const rt::DepthModelParameters& depth_model, const rt::PoseParameters& T_world_camera,
                       const rt::GridParameters& grid)
    : depth_model_(depth_model, T_world_camera),
      grid_(grid),
      builder_(depth_model_, grid),
      storage_(builder_.shape(), builder_.pointCapacity(), builder_.model()),
      core_(builder_.pointCapacity()) {
  rt::useDefaultFloatingPoint();  // as the daemon's threads do
  storage_.attachTo(scene_);
  directive_ = {
      .generation = 1, .engage = true, .engage_inside = true, .engage_request = 1, .parameters = {}};
  directive_.parameters.safety.engage_ramp_s = 0;  // for a person's comfort only
}

void OfflineBox::show(const rt::DepthFrame& frame) noexcept {
  frame_ = &frame;
  frame_is_new_ = true;
  frame_is_dated_ = false;
}

void OfflineBox::show(const rt::DepthFrame& frame, std::int64_t now_ns) noexcept {
  show(frame);
  frame_is_dated_ = true;
  setTime(now_ns);
}

void OfflineBox::setTime(std::int64_t now_ns) noexcept {
  now_ns_ = now_ns;
  time_is_set_ = true;
}

void OfflineBox::dateScene() noexcept {
  if (!frame_is_dated_) scene_.frame_time_ns = now_ns_;
}

void OfflineBox::model(const rt::Vec3& hip_m_in_world) noexcept {
  const rt::SceneNeeds needs = rt::SceneNeeds::of(directive_.parameters);
  builder_.build(*frame_, core_.focus_m_in_world(hip_m_in_world), rt::reachOfModel_m(needs, grid_), scene_,
                 needs);
  ++models_;
  frame_is_new_ = false;
}

bool OfflineBox::wouldModel(const rt::Vec3& hip_m_in_world) const noexcept {
  if (frame_ == nullptr || !rt::inWorkspace(hip_m_in_world)) return false;
  const rt::SceneNeeds needs = rt::SceneNeeds::of(directive_.parameters);
  return frame_is_new_ || !needs.metBy(scene_, core_.focus_m_in_world(hip_m_in_world), 0);
}

void OfflineBox::modelIfNeeded(const rt::Vec3& hip_m_in_world) noexcept {
  if (wouldModel(hip_m_in_world)) model(hip_m_in_world);
}

rt::Tick OfflineBox::tick(const rt::Vec3& hip_m_in_world, double period_s,
                          const rt::Vec3& velocity_m_per_s_in_world, double handle_delay_s) noexcept {
  modelIfNeeded(hip_m_in_world);
  directive_.parameters.safety.max_handle_speed_m_per_s = 0;  // the caller may jump
  if (!std::exchange(time_is_set_, false)) now_ns_ += std::llround(period_s * 1e9);
  dateScene();
  rt::HandleState handle{hip_m_in_world, velocity_m_per_s_in_world, ++samples_, now_ns_};
  handle.delay_s = handle_delay_s;
  return core_.step({.now_ns = now_ns_,
                     .period_s = period_s,
                     .scene = scene_,
                     .handle = handle,
                     .directive = directive_,
                     .start = start_,
                     .loop_period_s = loop_period_s_,
                     .fixtures = fixtures_,
                     .tissue = tissue_});
}

rt::ForceSample OfflineBox::lawForce(const rt::Vec3& hip_m_in_world) noexcept {
  modelIfNeeded(hip_m_in_world);
  dateScene();
  return core_.lawForce(scene_, hip_m_in_world, directive_.parameters,
                        rt::frameAge_s(scene_, now_ns_, start_.camera_latency_s));
}

}  // namespace hapticd::tools
