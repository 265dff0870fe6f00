// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include "config/settings/settings.h"
#include "drivers/base/start_thread.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/force_loop.h"
#include "rt/modelling/scene_builder.h"
#include "tools/hapticbench/jitter.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kFramePeriod_ns = 1'000'000'000 / 30;
constexpr std::chrono::milliseconds kLook{5};  // as hapticd's control thread

/// Returns settings with a wall 1 m away and a hand that stays near it. Nothing becomes stale, so that every
/// tick does the work of contact.
config::Settings settingsOf(const LoopSetting& setting) {
  config::Settings settings;
  settings.camera.of<drivers::SyntheticSettings>().scene = drivers::SyntheticScene::plane;
  settings.live.safety.handle_timeout_s = 1;
  settings.live.safety.depth_timeout_s = 5;
  settings.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world = {0, 0, -0.97};
  settings.handle.of<drivers::SimulatedHandleSettings>().travel_m = 0.05;
  settings.handle.of<drivers::SimulatedHandleSettings>().stroke_m = 0.01;
  settings.loop.rate_hz = 1e6 / static_cast<double>(setting.period_us);
  settings.loop.cpu = setting.cpu;
  settings.loop.priority = setting.priority;
  return settings;
}

/// The scene thread's work, in the calling thread.
class WallModel {
 public:
  WallModel(const config::Settings& settings, rt::SceneChannel& scenes)
      : grid_(settings.grid),
        needs_(rt::SceneNeeds::of(settings.effectiveLive())),
        model_(settings.camera.effectiveDepthModel(), settings.camera.pose()),
        builder_(model_, grid_),
        frame_(std::make_unique<rt::DepthFrame>()),
        scenes_(scenes) {
    storage_.reserve(3);
    scenes_.prepareSlots([this](rt::Scene& slot) {
      storage_.emplace_back(builder_.shape(), builder_.pointCapacity(), builder_.model()).attachTo(slot);
    });
    drivers::AnalyticScene(settings.camera.of<drivers::SyntheticSettings>(),
                           settings.camera.effectiveDepthModel())
        .render(0, *frame_);
    frame_->sequence = 0;
  }

  std::size_t pointCapacity() const { return builder_.pointCapacity(); }

  void showFrameIfDue(rt::TripleBuffer<rt::Vec3>& focus) {
    const std::int64_t now_ns = rt::monotonicNow_ns();
    if (now_ns < next_ns_) return;
    next_ns_ = now_ns + kFramePeriod_ns;
    frame_->arrival_ns = now_ns;
    ++frame_->sequence;
    focus.refresh();
    builder_.build(*frame_, focus.front(), rt::reachOfModel_m(needs_, grid_), scenes_.back(), needs_);
    scenes_.publish();
  }

 private:
  rt::GridParameters grid_;
  rt::SceneNeeds needs_;
  rt::DepthModel model_;
  rt::SceneBuilder builder_;
  std::vector<rt::SceneStorage> storage_;
  std::unique_ptr<rt::DepthFrame> frame_;
  rt::SceneChannel& scenes_;
  std::int64_t next_ns_ = 0;
};

/// The force loop in its thread, with what feeds it.
class RunningLoop {
 public:
  explicit RunningLoop(const config::Settings& settings)
      : settings_(settings),
        wall_(settings, scenes_),
        focus_(settings.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world),
        control_(std::make_unique<rt::ControlChannels>()),
        handle_(settings.handle.of<drivers::SimulatedHandleSettings>(),
                drivers::handleThreadPolicy(settings.handle, settings.loop, settings.loop.cpu)),
        loop_(settings.loop, settings.startParameters(), wall_.pointCapacity(),
              {scenes_, handle_channels_.state, handle_channels_.command, focus_, *control_}) {}
  ~RunningLoop() { stop(); }
  RunningLoop(const RunningLoop&) = delete;
  RunningLoop& operator=(const RunningLoop&) = delete;

  base::Result<void> start() {
    control_->directive.write({.generation = 1, .engage = true, .parameters = settings_.effectiveLive()});
    wall_.showFrameIfDue(focus_);
    if (auto started = handle_.start(handle_channels_); !started) return started;
    std::promise<rt::LoopPrivileges> prepared;
    auto thread = drivers::startThread("hapticd-force", [this, &prepared] {
      rt::ForceLoop& loop = loop_;
      prepared.set_value(loop.prepare());
      loop.run();
    });
    if (!thread) return std::unexpected(thread.error());
    thread_ = std::move(*thread);
    return check(prepared.get_future().get());
  }

  void stop() {
    loop_.requestStop();
    if (thread_.joinable()) thread_.join();
    handle_.stop();
  }

  void feed() { wall_.showFrameIfDue(focus_); }
  bool take(rt::Tick& tick) { return control_->ticks.pop(tick); }
  std::uint64_t lostTicks() const { return control_->ticks.dropped(); }
  std::uint64_t overruns() {
    control_->state.refresh();
    return control_->state.front().counters.overruns;
  }

 private:
  base::Result<void> check(const rt::LoopPrivileges& privileges) const {
    if (privileges.cpu != settings_.loop.cpu) {
      return std::unexpected(base::Error{fmt::format("CPU {}", settings_.loop.cpu),
                                         "the loop cannot be pinned to it", "choose another with --cpu"});
    }
    if (!privileges.realtime_scheduling) {
      return std::unexpected(base::Error{"SCHED_FIFO",
                                         fmt::format("priority {} is not permitted", settings_.loop.priority),
                                         "run as root, or with an rtprio line in limits.conf"});
    }
    return {};
  }

  config::Settings settings_;
  rt::SceneChannel scenes_;
  WallModel wall_;
  rt::TripleBuffer<rt::Vec3> focus_;
  drivers::HandleChannels handle_channels_;
  std::unique_ptr<rt::ControlChannels> control_;
  drivers::SimulatedHandle handle_;
  rt::ForceLoop loop_;
  std::thread thread_;
};

/// `handle_sequence`: of the newest measurement that a tick was added of.
void addTick(LoopRun& run, const rt::Tick& tick, std::uint64_t& handle_sequence) {
  if (std::exchange(handle_sequence, tick.handle.sequence) != tick.handle.sequence &&
      tick.handle.command_latency_ns > 0) {
    run.last_hop.addLatency(tick.handle.command_latency_ns);
  }
  run.wakeups.addLatency(tick.wakeup_latency_ns);
  run.contact_ticks += rt::inContact(tick) ? 1U : 0U;
  run.longest_tick_ns = std::max(run.longest_tick_ns, tick.compute_ns);
}

}  // namespace

base::Result<LoopRun> runForceLoop(const LoopSetting& setting, const Interrupt& interrupt) {
  // as the service does where a CPU is kept free, and cyclictest with --mainaffinity
  const KeptToCpus others(otherCpus(usableCpus(), setting.cpu));
  const auto loop = std::make_unique<RunningLoop>(settingsOf(setting));
  if (auto started = loop->start(); !started) return std::unexpected(started.error());
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(10 + 4 * setting.length_s());
  LoopRun run;
  rt::Tick tick;
  std::uint64_t handle_sequence = 0;
  while (run.wakeups.total() < setting.cycles) {
    if (interrupt.requested()) return std::unexpected(base::Error{"", "interrupted", ""});
    if (std::chrono::steady_clock::now() > deadline) {
      return std::unexpected(
          base::Error{"force loop", fmt::format("only {} of {} ticks", run.wakeups.total(), setting.cycles),
                      "is the CPU of --cpu taken by a task of higher priority?"});
    }
    while (run.wakeups.total() < setting.cycles && loop->take(tick)) addTick(run, tick, handle_sequence);
    loop->feed();
    std::this_thread::sleep_for(kLook);
  }
  run.overruns = loop->overruns();
  run.lost_ticks = loop->lostTicks();
  return run;
}

}  // namespace hapticd::tools
