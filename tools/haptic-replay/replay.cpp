// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/replay.h"

#include <cmath>

#include "config/law_choice.h"

namespace hapticd::tools {

Replay::Replay(const config::Settings& settings, const DepthSource& source, Stage stage,
               double handle_delay_s)
    : settings_(settings),
      source_(source),
      stage_(stage),
      depth_model_(settings.camera.effectiveDepthModel(), settings.camera.pose),
      builder_(depth_model_, settings.grid),
      storage_(builder_.shape(), builder_.pointCapacity()),
      core_(builder_.pointCapacity()),
      velocity_(settings.handle.resolution_m * settings.live.handle.motion_scale),
      handle_delay_s_(handle_delay_s),
      frame_(std::make_unique<rt::DepthFrame>()) {
  storage_.attachTo(scene_);
  settings_.live = settings_.effectiveLive();
  // The ramp is for a person's comfort; a replay begins engaged.
  settings_.live.safety.engage_ramp_s = 0;
  settings_.live.safety.max_handle_speed_m_per_s = 0;  // samples may lie far apart
}

config::Result<void> Replay::takeFrame(std::size_t index) {
  if (frame_taken_ && index == frame_index_) return {};
  if (auto read = source_.read(index, *frame_); !read) return read;
  frame_index_ = index;
  frame_taken_ = true;
  scene_.frame = 0;  // of another frame: to be modelled again
  return {};
}

void Replay::model(const rt::Vec3& hip_m_in_world) {
  const rt::SceneNeeds needs = rt::SceneNeeds::of(settings_.live);
  const rt::Vec3 focus = core_.focus_m_in_world(hip_m_in_world);
  if (scene_.frame != 0 && needs.metBy(scene_, focus, 0)) return;
  builder_.build(*frame_, focus, rt::reachOfModel_m(needs, settings_.grid), scene_, needs);
  ++models_;
}

/// The law `auto` is decided by the distance of the first HIP, and stays.
void Replay::decideLaw(const rt::Vec3& hip_m_in_world) {
  if (law_decided_) return;
  law_decided_ = true;
  const double distance_m = -depth_model_.positionInCamera(hip_m_in_world).z;
  if (settings_.force.law || !(distance_m > 0)) return;
  settings_.live = config::liveWith(
      settings_,
      config::chooseLaw(settings_.force.effectiveMaxError_n(settings_.live.safety),
                        settings_.live.springs.stiffness_n_per_m, config::distanceClass_m(distance_m, 0)));
}

config::Result<ReplayedForce> Replay::feel(const HipSample& sample) {
  decideLaw(sample.hip_m_in_world);
  const std::int64_t time_ns = std::llround(sample.time_s * 1e9);
  if (auto taken = takeFrame(source_.frameAt(time_ns)); !taken) return std::unexpected(taken.error());
  model(sample.hip_m_in_world);
  scene_.frame_time_ns = source_.arrival_ns(frame_index_, time_ns);
  ReplayedForce result{.force_n_in_world = {}, .points_used = 0, .frame = frame_index_};
  if (stage_ == Stage::command) {
    result.force_n_in_world = command(sample, time_ns, result.points_used);
    return result;
  }
  const rt::ForceSample force = core_.lawForce(scene_, sample.hip_m_in_world, settings_.live,
                                               rt::frameAge_s(scene_, time_ns, settings_.live));
  result.force_n_in_world = force.force_n_in_world;
  result.points_used = force.points_used;
  return result;
}

rt::Vec3 Replay::command(const HipSample& sample, std::int64_t time_ns, std::uint32_t& points_used) {
  const double period_s = samples_ == 0 ? 1 / settings_.loop.rate_hz : sample.time_s - last_time_s_;
  last_time_s_ = sample.time_s;
  rt::HandleState handle{sample.hip_m_in_world, velocity_.add(sample.hip_m_in_world, time_ns), ++samples_,
                         time_ns};
  handle.delay_s = handle_delay_s_;
  const rt::Directive directive{.generation = 1,
                                .engage = true,
                                .engage_inside = true,
                                .engage_request = 1,
                                .parameters = settings_.live};
  const rt::Tick tick = core_.step({.now_ns = time_ns,
                                    .period_s = period_s,
                                    .scene = scene_,
                                    .handle = handle,
                                    .directive = directive,
                                    .loop_period_s = 1 / settings_.loop.rate_hz});
  points_used = tick.points_used;
  return tick.command_force_n_in_world;
}

}  // namespace hapticd::tools
