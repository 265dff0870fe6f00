// SPDX-License-Identifier: Apache-2.0
#include "daemon/running_box.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <system_error>
#include <tuple>

#include "config/settings/parameter_table.h"
#include "daemon/box_warnings.h"
#include "daemon/stop_guard.h"
#include "daemon/trace/format/additions.h"
#include "daemon/trace/format/trace_format.h"
#include "drivers/camera/common_depth_header.h"
#include "drivers/driver_table.h"
#include "rt/base/clock.h"
#include "rt/base/realtime_thread.h"
#include "rt/laws/law_table.h"
#include "rt/loop/haptic_core.h"

namespace hapticd::daemon {
namespace {

constexpr std::chrono::seconds kFirstTickTimeout{5};
constexpr std::int64_t kSamplePeriod_ns = 1'000'000'000 / 15;
constexpr std::int64_t kLedPatternPeriod_ns = 1'000'000'000 / 20;

/// The CPU for the force thread; -1: the last one that the process may use.
int forceCpu(const config::Settings& settings) {
  return settings.loop.cpu >= 0 ? settings.loop.cpu : lastIsolatedCpu();
}

drivers::HandleThreadPolicy handleThreadPolicy(const config::Settings& settings) {
  const int cpu = forceCpu(settings);
  return drivers::handleThreadPolicy(settings.handle, settings.loop, isIsolated(cpu) ? cpu : -1);
}

std::unexpected<RunningBox::StartFailure> failure(const base::Result<void>& started, bool permanent) {
  return std::unexpected(RunningBox::StartFailure{started.error(), permanent});
}

/// The parameters and the request in a directive, for the trace, with the name of the law in use even where
/// the settings say auto.
trace::DirectiveRecord recordOf(const rt::Directive& directive, const config::Settings& settings) {
  trace::DirectiveRecord record;
  record.time_ns = rt::monotonicNow_ns();
  record.generation = directive.generation;
  record.engage = directive.engage;
  record.engage_inside = directive.engage_inside;
  record.engage_request = directive.engage_request;
  record.standoff_clearance_m = directive.parameters.standoff_clearance_m;
  config::Settings used = settings;
  used.live = directive.parameters;
  used.live.force.law = directive.parameters.law;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.effect != config::Effect::live) continue;
    record.parameters.emplace_back(parameter.name, config::toText(parameter.get(used)));
  }
  return record;
}

/// The version of the kernel, which cannot change while the daemon runs.
const std::string& kernelRelease() {
  static const std::string release = [] {
    utsname names{};
    return std::string(::uname(&names) == 0 ? names.release : "");
  }();
  return release;
}

}  // namespace

RunningBox::RunningBox(const config::Settings& settings, std::unique_ptr<FaultInjector> faults)
    : settings_(settings),
      faults_(std::move(faults)),
      depth_model_(settings.camera.effectiveDepthModel(), settings.camera.pose()),
      control_(std::make_unique<rt::ControlChannels>()),
      added_scene_(*control_, depth_model_, settings.camera.pose(), settings.state.folder),
      depth_tracker_(settings.camera.pose()),
      scene_thread_(settings.camera.effectiveDepthModel(), settings.camera.pose(), settings.grid,
                    rt::SceneNeeds::of(settings.effectiveLive()), scenes_, focus_),
      camera_(drivers::makeCamera(settings.camera)),
      handle_(drivers::makeHandle(settings.handle, settings.handle, handleThreadPolicy(settings))),
      leds_(drivers::makeLedPanel(settings.leds)),
      trace_(settings,
             {control_->trace, scene_thread_, core_memory_, [this] { return describeTrace(); },
              faults_ ? &trace_stalled_ : nullptr, [this] { return camera_->status().damaged_frames; }}) {
  if (faults_) {
    camera_ = faults_->around(std::move(camera_));
    handle_ = faults_->around(std::move(handle_));
  }
  added_scene_.loadSolids(settings_.additions.fixtures);
  added_scene_.apply(settings_.additions, settings_.live.tool.radius_m);
  // A person who engages it is told why not, and decides.
  directive_.engage = settings.control.engage_at_start && solidProblem(settings_.additions.fixtures).empty();
  recordAdditions();
  decideLaw();
}

RunningBox::~RunningBox() {
  stop();
}

std::expected<void, RunningBox::StartFailure> RunningBox::start() {
  start_ns_ = rt::monotonicNow_ns();
  if (faults_) faults_->start();
  sendDirective();
  if (auto started = leds_->start(); !started) return failure(started, true);
  showLeds();
  scene_thread_.start();
  if (auto started = handle_->start(handle_channels_); !started) return failure(started, true);
  if (auto started = startForceThread(); !started) return failure(started, false);
  if (auto started = trace_.start(); !started) return failure(started, false);
  if (auto started = camera_->start(scene_thread_); !started) return failure(started, true);
  if (auto ticked = waitForFirstTick(); !ticked) return failure(ticked, false);
  return {};
}

base::Result<void> RunningBox::startForceThread() {
  rt::LoopParameters loop_parameters = settings_.loop;
  loop_parameters.cpu = forceCpu(settings_);
  loop_ = std::make_unique<rt::ForceLoop>(
      loop_parameters, settings_.startParameters(), scene_thread_.pointCapacity(),
      rt::ForceLoopChannels{scenes_, handle_channels_.state, handle_channels_.command, focus_, *control_,
                            faults_ ? &stall_ns_ : nullptr, &core_memory_});
  idle_latency_.emplace();
  // Memory is locked before the thread exists, so that its stack is locked too. Where that is not permitted
  // the box runs with a warning.
  const bool memory_locked = rt::lockMemory();
  scene_thread_.returnUnusedMemory();
  added_scene_.returnUnusedMemory(memory_locked);
  std::promise<std::pair<rt::LoopPrivileges, pid_t>> prepared;
  try {
    force_thread_ = std::thread([this, &prepared] {
      rt::ForceLoop& loop = *loop_;
      prepared.set_value({loop.prepare(), ::gettid()});
      loop.run();
    });
  } catch (const std::system_error& error) {
    return base::failure("force thread", fmt::format("cannot be started: {}", error.what()),
                         "raise the limit of tasks or of locked memory");
  }
  pthread_setname_np(force_thread_.native_handle(), "hapticd-force");
  std::tie(privileges_, force_thread_id_) = prepared.get_future().get();
  privileges_.memory_locked = memory_locked;
  cpu_is_isolated_ = isIsolated(privileges_.cpu);
  if (const auto quota = drivers::cpuQuotaOf("self")) throttled_at_start_ = quota->throttled;
  return {};
}

base::Result<void> RunningBox::waitForFirstTick() {
  const auto deadline = std::chrono::steady_clock::now() + kFirstTickTimeout;
  while (loopState().counters.ticks == 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      return base::failure("force loop", "no tick within 5 s of the start",
                           "is the CPU of loop.cpu taken by a task of higher priority?");
    }
    showLeds();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  faults_at_start_ = pageFaultsOf(force_thread_id_);
  return {};
}

void RunningBox::stop() {
  if (force_thread_.joinable()) {
    loop_->requestStop();
    stopWithin("the force thread", StopLimits::kForceThread, [this] { force_thread_.join(); });
    idle_latency_.reset();
  }
  // The handle stops before everything that may hang, because that switches its motors off.
  stopWithin("the handle", StopLimits::kHandle, [this] { handle_->stop(); });
  stopWithin("the trace", StopLimits::kTraces, [this] { trace_.stop(); });
  stopWithin("the LEDs", StopLimits::kLeds, [this] { leds_->stop(); });
  stopWithin("the camera", StopLimits::kCamera, [this] { camera_->stop(); });
  stopWithin("the scene thread", StopLimits::kSceneThread, [this] { scene_thread_.stop(); });
}

std::uint64_t RunningBox::sendDirective() {
  directive_.parameters = live();
  ++directive_.generation;
  scene_thread_.setNeeds(rt::SceneNeeds::of(directive_.parameters), directive_.generation);
  control_->directive.write(directive_);
  trace_.add(recordOf(directive_, settings_));
  return directive_.generation;
}

std::uint64_t RunningBox::apply(const config::Settings& settings) {
  settings_.live = settings.live;
  return applyAdditions(settings.additions);
}

/// Every change of the fixtures and regions comes through here, except measured stiffness.
std::uint64_t RunningBox::applyAdditions(const config::SceneAdditions& additions) {
  settings_.additions = additions;
  added_scene_.apply(additions, settings_.live.tool.radius_m);
  recordAdditions();
  decideLaw();
  return sendDirective();
}

void RunningBox::recordAdditions() {
  if (added_scene_.sets() == nullptr) return;
  const auto& [fixtures, tissue] = *added_scene_.sets();
  if (std::pair(fixtures.generation, tissue.generation) == recorded_additions_) return;
  recorded_additions_ = {fixtures.generation, tissue.generation};
  trace_.add(trace::recordOf(settings_.additions, fixtures, tissue, added_scene_.solids().table(),
                             added_scene_.toolRadius_m(), rt::monotonicNow_ns()));
}

void RunningBox::setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) {
  for (const MeasuredStiffness& each : measured) {
    config::RegionSettings& region = settings_.additions.regions.at(each.region);
    region.stiffness_n_per_m = each.stiffness_n_per_m;
    region.damping_n_s_per_m = each.damping_n_s_per_m;
  }
  added_scene_.followStiffness(settings_.additions.regions);
  recordAdditions();
}

bool RunningBox::feedPose(const rt::FramePose& pose) {
  rt::FramePose numbered = pose;
  numbered.number = poses_fed_ + 1;
  if (!control_->frame_poses.push(numbered)) return false;
  ++poses_fed_;
  trace_.add(trace::recordOf(numbered, rt::monotonicNow_ns()));
  return true;
}

bool RunningBox::feedForce(const rt::ExternalForce& force) {
  if (loopState().tick.mode != rt::Mode::engaged) return false;
  control_->external_force.write(force);
  return true;
}

void RunningBox::moveHand(const rt::Vec3& target_m_in_world) {
  const double most_m = std::min(settings_.live.safety.workspace_radius_m, rt::kWorkspaceHalfEdge_m);
  const double distance_m = norm(target_m_in_world);
  handle_channels_.hand_target_m_in_world.write(
      distance_m > most_m ? (most_m / distance_m) * target_m_in_world : target_m_in_world);
}

rt::LiveParameters RunningBox::live() const {
  return !settings_.live.force.law ? config::liveWith(settings_, law_decision_) : settings_.effectiveLive();
}

void RunningBox::decideLaw() {
  constexpr double kUsualDistance_m = 1;
  law_decision_ = config::chooseLaw(
      settings_, surface_seen_.value_or(config::asSeenBy(scene_thread_.camera(), kUsualDistance_m)));
}

/// Chooses the law again when noise or pitch of the surface in contact have changed.
void RunningBox::adaptToDistance() {
  const rt::Tick& tick = loopState().tick;
  if (tick.scene_frame == 0 || !rt::inWorkspace(tick.proxy_m_in_world)) return;
  distance_m_ = std::max(0.0, -depth_model_.positionInCamera(tick.proxy_m_in_world).z);
  if (settings_.live.force.law || distance_m_ <= 0) return;
  const config::SurfaceAsSeen seen = config::asSeenBy(scene_thread_.camera(), distance_m_);
  const config::SurfaceAsSeen steady = config::steady(seen, surface_seen_.value_or(config::SurfaceAsSeen{}));
  if (steady == surface_seen_) return;
  surface_seen_ = steady;
  decideLaw();
  sendDirective();
}

LawStatus RunningBox::lawStatus(const rt::LoopState& loop) const {
  const rt::LiveParameters& live = directive_.parameters;
  LawStatus status;
  status.law = live.law;
  status.filtered = rt::rowOf(live.law).reads_filtered && !live.filter.isOff();
  status.max_error_n = settings_.effectiveMaxError_n();
  status.distance_m = distance_m_;
  status.hand_stiffness_n_per_m = loop.tick.stiffness_gain * live.force.stiffness_n_per_m *
                                  settings_.handle.motion_scale * settings_.handle.force_scale;
  if (settings_.live.force.law) {
    status.reason = "set in force.law";
    return status;
  }
  status.expected_error_n = law_decision_.error_n;
  status.reason = law_decision_.reason;
  return status;
}

std::uint64_t RunningBox::engage(bool engaged, bool inside) {
  return engage_requests_.ask(engaged, inside, loopState(), directive_) ? sendDirective()
                                                                        : directive_.generation;
}

bool RunningBox::engaged() {
  const rt::LoopState& loop = loopState();
  const bool requested = directive_.engage && loop.directive_generation < directive_.generation;
  return requested || loop.tick.mode == rt::Mode::engaged || loop.tick.mode == rt::Mode::holding;
}

std::uint64_t RunningBox::acknowledgedGeneration() {
  return loopState().directive_generation;
}

const rt::LoopState& RunningBox::loopState() {
  control_->state.refresh();
  return control_->state.front();
}

void RunningBox::drainTicks(const std::function<void(const rt::Tick&)>& on_tick) {
  injectFaults();
  if (faults_ && faults_->isOn(Fault::channel_overflow)) return;
  rt::Tick tick;
  // bounded, because the loop may push while this pops
  for (std::size_t i = 0; i < rt::kTickRingCapacity && control_->ticks.pop(tick); ++i) {
    if (on_tick) on_tick(tick);
  }
  adaptToDistance();
  if (added_scene_.takeFiles(loopState().tick.fixture_generation)) recordAdditions();
  trackSolids();
  sampleRate();
  showLeds();
}

void RunningBox::trackSolids() {
  const bool tracked = depth_tracker_.tracks();
  depth_tracker_.track(added_scene_.trackedSolids());
  if (depth_tracker_.tracks() != tracked) passDepthOn();
  if (!depth_tracker_.tracks()) return;
  depth_tracker_.setHip(loopState().tick.hip_m_in_world);
  for (const rt::FramePose& pose : depth_tracker_.takePoses()) feedPose(pose);
}

void RunningBox::injectFaults() {
  if (!faults_) return;
  constexpr std::int64_t kStall_ns = 3'000'000;
  trace_stalled_.store(faults_->isOn(Fault::channel_overflow), std::memory_order_relaxed);
  stall_ns_.store(faults_->isOn(Fault::late_ticks) ? kStall_ns : 0, std::memory_order_relaxed);
}

void RunningBox::showLeds() {
  if (settings_.leds.driver == config::LedDriver::none) return;
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (now_ns - led_patterns_ns_ >= kLedPatternPeriod_ns) {
    led_patterns_ = patternsOf(condition_watch_.follow(condition(), now_ns));
    led_patterns_ns_ = now_ns;
  }
  leds_->show(litLeds(led_patterns_, now_ns));
}

void RunningBox::sampleRate() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  const Sample& newest = samples_[(next_sample_ + samples_.size() - 1) % samples_.size()];
  if (now_ns - newest.time_ns < kSamplePeriod_ns) return;
  samples_[next_sample_] = {now_ns, loopState().counters.ticks};
  next_sample_ = (next_sample_ + 1) % samples_.size();
  lateness_.follow(loopState().counters, now_ns);
}

double RunningBox::rate_hz() const {
  const auto [oldest, newest] =
      std::minmax_element(samples_.begin(), samples_.end(),
                          [](const Sample& a, const Sample& b) { return a.time_ns < b.time_ns; });
  const Sample begin = oldest->time_ns == 0 ? Sample{start_ns_, 0} : *oldest;
  if (newest->time_ns <= begin.time_ns) return 0;
  return static_cast<double>(newest->ticks - begin.ticks) * 1e9 /
         static_cast<double>(newest->time_ns - begin.time_ns);
}

BoxStatus RunningBox::condition() {
  BoxStatus status;
  status.loop.state = loopState();
  status.camera = camera_->status();
  const bool streams = status.camera.state == drivers::CameraState::streaming;
  if (streams && status.camera.advice.empty()) status.camera.advice = scene_thread_.depthAdvice();
  status.scene = scene_thread_.status();
  status.handle = handle_->status();
  status.leds = {leds_->status(), led_patterns_};
  status.trace = trace_.status();
  status.fixtures = added_scene_.fixtureStatus(status.loop.state, settings_.live.proximity.warning_m);
  status.frames = added_scene_.frameStatus(status.loop.state);
  for (FrameStatus& frame : status.frames) {
    if (const auto found = limited_poses_.find(frame.name); found != limited_poses_.end())
      frame.limited = found->second;
    if (const auto result = depth_tracker_.resultOf(config::frameIdentity(frame.name))) {
      frame.tracking = result->verdict;
      frame.tracking_error_m = result->error_m;
      frame.tracking_share = result->share;
    }
  }
  status.tissue = added_scene_.tissueStatus(status.loop.state.tick);
  status.tissue.feed = feed_status_;
  status.warnings = warnings(status);
  if (const std::string fault = scene_thread_.cameraFault(); !fault.empty())
    status.warnings.push_back("the frames of this camera cannot be modelled: " + fault);
  return status;
}

std::optional<std::uint64_t> RunningBox::pageFaultsSinceStart() const {
  const auto faults = pageFaultsOf(force_thread_id_);
  if (!faults || !faults_at_start_) return std::nullopt;
  return *faults - *faults_at_start_;
}

BoxStatus RunningBox::status() {
  BoxStatus status = condition();
  status.version = HAPTICD_VERSION;
  status.kernel = kernelRelease();
  status.loop.page_faults = pageFaultsSinceStart();
  status.loop.privileges = privileges_;
  status.loop.rate_hz = rate_hz();
  status.loop.wakeup_latency = rt::summaryOf(control_->wakeup_latency);
  status.loop.compute_time = rt::summaryOf(control_->compute_time);
  status.loop.trace_ticks_dropped = control_->trace.dropped();
  status.law = lawStatus(status.loop.state);
  status.pending_reload = pending_reload_;
  status.control = control_status_;
  status.control.ticks_lost = control_->ticks.dropped();
  status.uptime_s = static_cast<double>(rt::monotonicNow_ns() - start_ns_) * 1e-9;
  return status;
}

trace::TraceOptions RunningBox::describeTrace() const {
  trace::TraceOptions options;
  utsname kernel{};
  ::uname(&kernel);
  options.metadata = {{std::string(trace::kWriterVersionKey), HAPTICD_VERSION},
                      {std::string(trace::kRunKey), fmt::format("{}-{}", ::getpid(), start_ns_)},
                      {"kernel", fmt::format("{} {} {}", kernel.sysname, kernel.release, kernel.version)},
                      {"host", kernel.nodename},
                      {"machine", kernel.machine},
                      {"camera", camera_->status().identity},
                      {"handle", handle_->status().identity},
                      {"force_thread_cpu", fmt::format("{}", privileges_.cpu)},
                      {"realtime_scheduling", privileges_.realtime_scheduling ? "yes" : "no"}};
  options.depth_header = drivers::commonDepthHeader(settings_.camera, camera_->status().identity);
  return options;
}

std::vector<std::string> RunningBox::warnings(const BoxStatus& status) const {
  std::vector<std::string> list = notices_;
  if (faults_) list.push_back(faults_->notice());
  if (std::string warning = added_scene_.warning(scene_thread_.camera()); !warning.empty())
    list.push_back(std::move(warning));
  if (std::string problem = solidProblem(settings_.additions.fixtures); !problem.empty())
    list.push_back(std::move(problem));
  auto quota = lateness_.lateness().late ? drivers::cpuQuotaOf("self") : std::nullopt;
  if (quota && quota->throttled <= throttled_at_start_) quota.reset();
  const std::vector<std::string> found =
      warningsOf(status, {.settings = settings_,
                          .live = directive_.parameters,
                          .privileges = privileges_,
                          .cpus_may_sleep = idle_latency_ && !idle_latency_->held(),
                          .cpu_is_isolated = cpu_is_isolated_,
                          .lateness = lateness_.lateness(),
                          .cpu_quota = std::move(quota)});
  list.insert(list.end(), found.begin(), found.end());
  return list;
}

std::future<base::Result<std::string>> RunningBox::startTrace(const TraceRequest& request) {
  return trace_.startTrace(request);
}

std::future<base::Result<std::string>> RunningBox::stopTrace() {
  return trace_.stopTrace();
}

std::future<base::Result<std::string>> RunningBox::dumpTrace() {
  return trace_.dumpTrace();
}

std::future<base::Result<std::vector<trace::TraceEntry>>> RunningBox::listTraces() {
  return trace_.listTraces();
}

std::future<base::Result<void>> RunningBox::deleteTrace(const std::string& name) {
  return trace_.deleteTrace(name);
}

std::future<base::Result<void>> RunningBox::keepTrace(const std::string& name, bool keep) {
  return trace_.keepTrace(name, keep);
}

std::future<base::Result<void>> RunningBox::noteTrace(const std::string& name, const std::string& text) {
  return trace_.noteTrace(name, text);
}

std::future<base::Result<SceneSnapshot>> RunningBox::takeSnapshot() {
  auto promise = std::make_shared<std::promise<base::Result<SceneSnapshot>>>();
  auto future = promise->get_future();
  scene_thread_.requestFrame([promise, pose = settings_.camera.pose(),
                              tick = loopState().tick](std::unique_ptr<rt::DepthFrame> frame) {
    if (frame) {
      const rt::DepthModelParameters camera = frame->camera;
      promise->set_value(SceneSnapshot{std::move(frame), camera, pose, tick});
    } else {
      promise->set_value(std::unexpected(
          base::Error{"camera", "no depth frame has arrived yet", "see hapticctl status for the camera"}));
    }
  });
  return future;
}

base::Result<SharedDepth> RunningBox::shareDepth() {
  auto region = drivers::DepthRegionWriter::create(sizeof(rt::DepthFrame::raw));
  if (!region) return std::unexpected(region.error());
  depth_region_ = std::move(*region);
  passDepthOn();
  return SharedDepth{depth_region_->descriptor(), depth_region_->bytes()};
}

void RunningBox::hideDepth() {
  scene_thread_.setView({});
  depth_region_.reset();
  passDepthOn();
}

/// Passes depth frames to whoever wants them now.
void RunningBox::passDepthOn() {
  drivers::DepthRegionWriter* const region = depth_region_.get();
  DepthTracker* const tracker = depth_tracker_.tracks() ? &depth_tracker_ : nullptr;
  if (region == nullptr && tracker == nullptr) return scene_thread_.setView({});
  scene_thread_.setView(
      [region, tracker, &camera = *camera_, settings = settings_.camera](const rt::DepthFrame& frame) {
        if (tracker != nullptr) tracker->show(frame);
        if (region == nullptr) return;
        // The camera may have been found only now, so that its serial number is asked for each time.
        const rt::DepthFrameHeader common = drivers::commonDepthHeader(settings, camera.status().identity);
        region->publish(trace::headerOf(common, frame), std::as_bytes(frame.image()));
      });
}

void RunningBox::onEvent(const JournalEntry& entry) {
  trace::EventRecord event{rt::monotonicNow_ns(), entry.event ? nameOf(*entry.event) : "log", entry.text, {}};
  for (const auto& [name, value] : entry.fields) event.fields.emplace_back(name, value);
  trace_.add(std::move(event));
}

}  // namespace hapticd::daemon
