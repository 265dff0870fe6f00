// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/settings/law_choice.h"
#include "config/settings/settings.h"
#include "daemon/added_scene.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/box_warnings.h"
#include "daemon/fault_injector.h"
#include "daemon/indicators.h"
#include "daemon/recorder/trace_recorder.h"
#include "daemon/scene/scene_thread.h"
#include "drivers/base/idle_latency.h"
#include "drivers/camera/camera.h"
#include "drivers/depth_region/depth_region.h"
#include "drivers/handle/handle.h"
#include "drivers/led/led_panel.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/force_loop.h"
#include "rt/loop/supervisor.h"

namespace hapticd::daemon {

/// Camera, scene thread, force loop and handle, wired together.
/// Thread: all public functions from the control thread.
class RunningBox final : public Box {
 public:
  /// `faults`: the faults to inject; null: none.
  explicit RunningBox(const config::Settings& settings, std::unique_ptr<FaultInjector> faults = nullptr);
  /// Stops the box as stop() does.
  ~RunningBox() override;

  /// The reason why start() failed.
  struct StartFailure {
    base::Error error;
    bool permanent = true;  ///< the settings are the cause, so the next attempt will fail too
  };

  /// Starts everything and waits for the first tick.
  /// Errors: a driver that cannot work with its settings, a thread that cannot be started.
  std::expected<void, StartFailure> start();
  /// Brings the force to zero, then ends the threads. Harmless when not started. A part that hangs ends the
  /// process (stop_guard.h).
  void stop();

  /// Takes the ticks since the last call and passes each to `on_tick`, which may be empty.
  void drainTicks(const std::function<void(const rt::Tick&)>& on_tick);

  /// A number that grows as long as the force loop runs.
  std::uint64_t heartbeat() { return loopState().counters.ticks; }
  /// Sets the warnings of the status that come from outside the box; replaces those given before.
  void setNotices(std::vector<std::string> notices) { notices_ = std::move(notices); }
  void setControlStatus(const ControlStatus& status) { control_status_ = status; }
  void setFeedStatus(const FeedStatus& status) { feed_status_ = status; }
  /// Poses that were refused because they came too fast, by the name of their frame.
  void setLimitedPoses(const std::map<std::string, std::uint64_t, std::less<>>& limited) {
    limited_poses_ = limited;
  }
  void setPendingReload(const std::optional<PendingReload>& pending) { pending_reload_ = pending; }
  const std::optional<PendingReload>& pendingReload() const { return pending_reload_; }

  BoxStatus status() override;
  const config::Settings& settings() const override { return settings_; }
  std::uint64_t apply(const config::Settings& settings) override;
  const config::SceneAdditions& additions() const override { return settings_.additions; }
  AdditionGenerations additionGenerations() const override { return added_scene_.generations(); }
  std::uint64_t applyAdditions(const config::SceneAdditions& additions) override;
  void setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) override;
  bool feedPose(const rt::FramePose& pose) override;
  bool feedForce(const rt::ExternalForce& force) override;
  void moveHand(const rt::Vec3& target_m_in_world) override;
  std::uint64_t engage(bool engaged, bool inside) override;
  bool engaged() override;
  std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const override {
    return added_scene_.regionAt(position_m_in_world);
  }
  bool knowsSolid(const std::string& sha256) const override { return added_scene_.solids().knows(sha256); }
  std::future<base::Result<StoredSolid>> storeSolid(base::Descriptor memory) override {
    return added_scene_.solids().store(std::move(memory));
  }
  base::Result<void> takeSolid(StoredSolid stored) override {
    return added_scene_.solids().take(std::move(stored));
  }
  std::shared_ptr<const config::Solid> solid(const std::string& sha256) const override {
    return added_scene_.solids().inMemory(sha256);
  }
  bool readsSolids() const override { return added_scene_.solids().loading(); }
  std::string solidProblem(const std::vector<config::FixtureSettings>& fixtures) const override {
    return added_scene_.solids().problemOf(fixtures);
  }
  std::uint64_t acknowledgedGeneration() override;
  std::future<base::Result<std::string>> startTrace(const TraceRequest& request) override;
  std::future<base::Result<std::string>> stopTrace() override;
  std::future<base::Result<std::string>> dumpTrace() override;
  std::future<base::Result<std::vector<trace::TraceEntry>>> listTraces() override;
  std::future<base::Result<void>> deleteTrace(const std::string& name) override;
  std::future<base::Result<void>> keepTrace(const std::string& name, bool keep) override;
  std::future<base::Result<void>> noteTrace(const std::string& name, const std::string& text) override;
  std::future<base::Result<SceneSnapshot>> takeSnapshot() override;
  base::Result<SharedDepth> shareDepth() override;
  void hideDepth() override;
  /// Records the event in the trace.
  void onEvent(const JournalEntry& entry);

 private:
  /// The number of ticks at a given time, to compute the rate from.
  struct Sample {
    std::int64_t time_ns = 0;
    std::uint64_t ticks = 0;
  };

  void injectFaults();
  /// Lets the depth tracker follow the solids that frames name, and gives their poses to the force loop.
  void trackSolids();
  void passDepthOn();
  base::Result<void> startForceThread();
  base::Result<void> waitForFirstTick();
  std::uint64_t sendDirective();
  /// Puts the fixtures and regions into the trace where they have changed.
  void recordAdditions();
  /// The parameters for the force loop: the settings, with the law that `auto` has chosen.
  rt::LiveParameters live() const;
  void decideLaw();
  void adaptToDistance();
  LawStatus lawStatus(const rt::LoopState& loop) const;
  const rt::LoopState& loopState();
  std::optional<std::uint64_t> pageFaultsSinceStart() const;
  void sampleRate();
  double rate_hz() const;
  /// The part of status() that costs little: states of the devices and warnings, without statistics.
  BoxStatus condition();
  void showLeds();
  /// Describes the box for the head of a trace, beside its settings.  Thread: trace thread.
  trace::TraceOptions describeTrace() const;
  std::vector<std::string> warnings(const BoxStatus& status) const;

  config::Settings settings_;
  const std::unique_ptr<FaultInjector> faults_;  // outlives the devices that it wraps
  std::atomic<std::int64_t> stall_ns_{
      0};  // injected delay of the force loop; relaxed: no other data depends on it
  std::atomic<bool> trace_stalled_{false};  // injected: the trace thread takes no ticks; relaxed likewise
  rt::DepthModel depth_model_;
  rt::SceneChannel scenes_;
  rt::TripleBuffer<rt::Vec3> focus_;
  drivers::HandleChannels handle_channels_;
  std::unique_ptr<rt::ControlChannels> control_;
  AddedScene added_scene_;
  DepthTracker depth_tracker_;  // outlives the scene thread, which shows it frames
  std::pair<std::uint64_t, std::uint64_t> recorded_additions_;  // their generations in the trace
  rt::CoreMemoryChannel core_memory_;
  SceneThread scene_thread_;
  std::unique_ptr<drivers::Camera> camera_;
  std::unique_ptr<drivers::Handle> handle_;
  std::unique_ptr<drivers::LedPanel> leds_;
  TraceRecorder trace_;
  std::unique_ptr<drivers::DepthRegionWriter> depth_region_;  // null: nobody looks
  std::unique_ptr<rt::ForceLoop> loop_;
  std::thread force_thread_;
  rt::LoopPrivileges privileges_;
  std::optional<drivers::IdleLatencyLimit> idle_latency_;  // held while the loop runs
  pid_t force_thread_id_ = 0;
  std::optional<std::uint64_t> faults_at_start_;
  rt::Directive directive_;
  rt::EngageRequests engage_requests_;
  config::LawDecision law_decision_;  // valid while force.law is auto
  std::optional<config::SurfaceAsSeen>
      surface_seen_;       // of law_decision_; nothing: there has been no contact yet
  double distance_m_ = 0;  // from the camera to the proxy; 0: not known
  ConditionWatch condition_watch_;
  LedPatterns led_patterns_{};
  std::int64_t led_patterns_ns_ = 0;  // when led_patterns_ were chosen
  std::vector<std::string> notices_;
  ControlStatus control_status_;
  FeedStatus feed_status_;
  std::map<std::string, std::uint64_t, std::less<>> limited_poses_;
  std::uint64_t poses_fed_ = 0;
  std::optional<PendingReload> pending_reload_;
  std::int64_t start_ns_ = 0;
  std::array<Sample, 16> samples_{};  // a ring buffer that spans about a second
  std::size_t next_sample_ = 0;
  LatenessWatch lateness_;
  bool cpu_is_isolated_ = false;
  std::uint64_t throttled_at_start_ = 0;  // CpuQuota::throttled
};

}  // namespace hapticd::daemon
