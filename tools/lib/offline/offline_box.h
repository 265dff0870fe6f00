// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/haptic_core.h"
#include "rt/modelling/scene_builder.h"

namespace hapticd::tools {

/// Computes forces from depth frames without threads, devices and a clock, for benchmarks, replays and tests.
/// The caller sets the time, by the periods of the ticks or by setTime(); the same calls give the same
/// forces. Thread: one.
class OfflineBox {
 public:
  /// Gives the calling thread the default floating-point environment, as the daemon's threads have it.
  OfflineBox(const rt::DepthModelParameters& depth_model, const rt::PoseParameters& T_world_camera,
             const rt::GridParameters& grid);
  OfflineBox(const OfflineBox&) = delete;
  OfflineBox& operator=(const OfflineBox&) = delete;

  const rt::DepthModel& depthModel() const noexcept { return depth_model_; }
  const rt::Scene& scene() const noexcept { return scene_; }
  rt::LiveParameters& parameters() noexcept { return directive_.parameters; }
  const rt::LiveParameters& parameters() const noexcept { return directive_.parameters; }
  rt::StartParameters& start() noexcept { return start_; }

  /// `frame` is the newest one from now on; it outlives its use. Modelled at the next tick or force. It
  /// counts as just arrived at every tick, however long it is shown: its age is 0 and it never becomes stale.
  void show(const rt::DepthFrame& frame) noexcept;

  /// Like show(frame), but the frame counts as arrived at its `arrival_ns`, so that ticks know its true age
  /// and it becomes stale. `now_ns`: as for setTime().
  void show(const rt::DepthFrame& frame, std::int64_t now_ns) noexcept;

  /// `now_ns`: the time of the next tick, on the clock of the frames' arrivals, whatever the period of that
  /// tick; the ticks after it follow by their periods. The time of lawForce() as well. Never earlier than the
  /// last tick.
  void setTime(std::int64_t now_ns) noexcept;

  /// Sets how long a device holds each force if that differs from the periods of the ticks; 0: it does not.
  void setLoopPeriod(double period_s) noexcept { loop_period_s_ = period_s; }

  /// Fixtures and tissue regions from now on; null: none. They outlive their use.
  void setAdditions(const rt::FixtureSet* fixtures, const rt::TissueMap* tissue) noexcept {
    fixtures_ = fixtures;
    tissue_ = tissue;
  }

  /// Runs one tick of the whole core, engaged, `period_s` after the one before; models the frame first where
  /// that is needed, as the scene thread would have done in time. `handle_delay_s`: as a driver reports it
  /// (rt::HandleState::delay_s); the caller delays the force.
  rt::Tick tick(const rt::Vec3& hip_m_in_world, double period_s = 0.001,
                const rt::Vec3& velocity_m_per_s_in_world = {}, double handle_delay_s = 0) noexcept;

  /// The law's force alone, before any blend or limit, at the time of setTime() or else of the last tick;
  /// models first where needed.
  rt::ForceSample lawForce(const rt::Vec3& hip_m_in_world) noexcept;

  /// True if a tick or force at that HIP would model the newest frame first.
  bool wouldModel(const rt::Vec3& hip_m_in_world) const noexcept;

  /// Models the newest frame around where the next force needs it, whether needed or not.
  void model(const rt::Vec3& hip_m_in_world) noexcept;

  std::uint64_t models() const noexcept { return models_; }
  rt::HapticCore& core() noexcept { return core_; }

 private:
  void modelIfNeeded(const rt::Vec3& hip_m_in_world) noexcept;
  void dateScene() noexcept;

  rt::DepthModel depth_model_;
  rt::GridParameters grid_;
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
  rt::HapticCore core_;
  rt::Directive directive_;
  rt::StartParameters start_;
  const rt::DepthFrame* frame_ = nullptr;
  bool frame_is_new_ = false;
  std::uint64_t models_ = 0;
  std::uint64_t samples_ = 0;
  bool frame_is_dated_ = false;  ///< it arrived at its arrival_ns, not just now
  bool time_is_set_ = false;     ///< now_ns_ is the time of the next tick, else of the last one
  std::int64_t now_ns_ = 0;
  double loop_period_s_ = 0;
  const rt::FixtureSet* fixtures_ = nullptr;
  const rt::TissueMap* tissue_ = nullptr;
};

}  // namespace hapticd::tools
