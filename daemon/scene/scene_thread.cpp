// SPDX-License-Identifier: Apache-2.0
#include "daemon/scene/scene_thread.h"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"
#include "rt/base/realtime_thread.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/haptic_core.h"

namespace hapticd::daemon {
namespace {

using rt::SolidPose;
using rt::Vec3;

/// A hand and its tool within this distance of the HIP are not taken for the solid.
constexpr double kHandRadius_m = 0.03;
/// Poses that wait for the control thread; it takes them every few milliseconds.
constexpr std::size_t kMaxPoses = 64;

/// T_world_frame of a solid that was found at T_world_solid.
rt::RigidPose frameOf(const SolidPose& T_world_solid, const SolidPose& T_frame_solid) {
  SolidPose T_world_frame;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += T_world_solid.rotation[3 * row + k] * T_frame_solid.rotation[3 * column + k];
      T_world_frame.rotation[3 * row + column] = sum;
    }
  }
  T_world_frame.position_m = T_world_solid.position_m - T_world_frame.directionOut(T_frame_solid.position_m);
  return {T_world_frame.position_m, rt::normalised(rt::quaternionOf(T_world_frame.rotation))};
}

}  // namespace

struct DepthTracker::Follower {
  explicit Follower(TrackedSolid solid)
      : tracked(std::move(solid)), tracker(tracked.solid->grid()), pose(tracked.T_frame_solid) {}

  /// Looks for the solid in a frame.
  rt::Tracking step(const rt::DepthModel& model, const rt::DepthFrame& frame, const Vec3& hip_m_in_world) {
    rt::TrackingRequest request;
    request.predicted = pose;
    if (found) request.last = pose;
    request.frames_since_last = frames_since_last;
    request.target_m_in_solid = nearestIn(tracker.ball(), pose.placeIn(hip_m_in_world));
    request.mask = rt::SightMask{hip_m_in_world, hip_m_in_world, kHandRadius_m};
    const rt::Tracking tracking = tracker.step(model, frame.image(), request, limits);
    if (tracking.verdict == rt::TrackingVerdict::tracked) {
      pose = tracking.pose;
      found = true;
      frames_since_last = 1;
    } else {
      frames_since_last = std::min(frames_since_last + 1, std::numeric_limits<int>::max() - 1);
    }
    return tracking;
  }

  /// The place of the solid that is touched first: in its ball, as near to the HIP as possible.
  static Vec3 nearestIn(const rt::SolidBall& ball, const Vec3& hip_m_in_solid) {
    const Vec3 out = hip_m_in_solid - ball.centre_m;
    const double distance_m = norm(out);
    return distance_m <= ball.radius_m ? hip_m_in_solid : ball.centre_m + (ball.radius_m / distance_m) * out;
  }

  const TrackedSolid tracked;
  const rt::TrackingLimits limits{};
  rt::SolidTracker tracker;
  SolidPose pose;  ///< T_world_solid: the last that was found, or that of the start
  bool found = false;
  int frames_since_last = 1;
};

DepthTracker::DepthTracker(const rt::PoseParameters& T_world_camera) : T_world_camera_(T_world_camera) {}

DepthTracker::~DepthTracker() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void DepthTracker::track(std::vector<TrackedSolid> solids) {
  if (solids != solids_) request(std::move(solids));
  if (!tracks() || thread_.joinable()) return;
  auto started = drivers::startThread("tracking", [this] { run(); });
  if (started) thread_ = std::move(*started);  // else the next call tries again
}

void DepthTracker::request(std::vector<TrackedSolid> solids) {
  solids_ = std::move(solids);
  if (!frames_ && tracks()) frames_ = std::make_unique<rt::TripleBuffer<rt::DepthFrame>>();
  const std::lock_guard lock(mutex_);
  requested_ = solids_;
  poses_.clear();
  std::erase_if(results_, [this](const TrackingResult& result) {
    return std::ranges::find(requested_, result.frame, &TrackedSolid::frame) == requested_.end();
  });
}

void DepthTracker::setHip(const Vec3& hip_m_in_world) {
  const std::lock_guard lock(mutex_);
  hip_m_in_world_ = hip_m_in_world;
}

void DepthTracker::show(const rt::DepthFrame& frame) {
  rt::DepthFrame& back = frames_->back();
  back.camera = frame.camera;
  back.sequence = frame.sequence;
  back.arrival_ns = frame.arrival_ns;
  back.exposure_ns = frame.exposure_ns;
  std::ranges::copy(frame.image(), back.raw);
  frames_->publish();
  {
    const std::lock_guard lock(mutex_);
    shown_ = true;
  }
  wake_.notify_one();
}

std::vector<rt::FramePose> DepthTracker::takePoses() {
  const std::lock_guard lock(mutex_);
  return std::exchange(poses_, {});
}

std::optional<TrackingResult> DepthTracker::resultOf(std::uint32_t frame) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(results_, frame, &TrackingResult::frame);
  return found == results_.end() ? std::nullopt : std::optional(*found);
}

/// Waits for a frame; takes what is to be tracked in it. False: the thread is to end.
bool DepthTracker::waitForFrame(std::vector<std::unique_ptr<Follower>>& followers, Vec3& hip_m_in_world) {
  std::vector<TrackedSolid> wanted;
  {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return shown_ || stop_; });
    if (stop_) return false;
    shown_ = false;
    hip_m_in_world = hip_m_in_world_;
    wanted = requested_;
  }
  std::vector<std::unique_ptr<Follower>> next;
  for (TrackedSolid& solid : wanted) {
    const auto known = std::ranges::find_if(
        followers, [&](const auto& follower) { return follower && follower->tracked == solid; });
    next.push_back(known != followers.end() ? std::move(*known)
                                            : std::make_unique<Follower>(std::move(solid)));
  }
  followers = std::move(next);
  frames_->refresh();
  return true;
}

void DepthTracker::run() {
  std::vector<std::unique_ptr<Follower>> followers;
  std::optional<rt::DepthModel> model;
  Vec3 hip;
  while (waitForFrame(followers, hip)) {
    const rt::DepthFrame& frame = frames_->front();
    if (!model || !(model->parameters() == frame.camera)) model.emplace(frame.camera, T_world_camera_);
    for (const auto& follower : followers) {
      const rt::Tracking tracking = follower->step(*model, frame, hip);
      const std::uint32_t id = follower->tracked.frame;
      const TrackingResult result{id, tracking.verdict, tracking.targetError_m(follower->limits.confidence),
                                  tracking.share};
      const std::lock_guard lock(mutex_);
      if (std::ranges::find(requested_, follower->tracked) == requested_.end()) continue;
      std::erase_if(results_, [id](const TrackingResult& old) { return old.frame == id; });
      results_.push_back(result);
      if (tracking.verdict != rt::TrackingVerdict::tracked || poses_.size() >= kMaxPoses) continue;
      poses_.push_back({.frame = id,
                        .T_world_frame = frameOf(follower->pose, follower->tracked.T_frame_solid),
                        .time_ns = frame.exposure_ns != 0 ? frame.exposure_ns : frame.arrival_ns});
    }
  }
}

namespace {

/// How often the position of the HIP is checked between two frames.
constexpr std::chrono::milliseconds kLookAtHip{2};

/// The frame rate in the status is a mean over about this many frames.
constexpr double kFramesOfMean = 10;

}  // namespace

SceneThread::SceneThread(const rt::DepthModelParameters& camera, const rt::PoseParameters& T_world_camera,
                         const rt::GridParameters& parameters, const rt::SceneNeeds& needs,
                         rt::SceneChannel& scenes, rt::TripleBuffer<rt::Vec3>& focus_m_in_world)
    : parameters_(parameters),
      scenes_(scenes),
      focus_(focus_m_in_world),
      source_(camera, T_world_camera, parameters),
      frames_(std::make_unique<rt::FrameChannel>()),
      models_(std::make_unique<ModelRing>()),
      camera_(camera),
      requested_{needs, 0} {
  scenes_.prepareSlots([this](rt::Scene& slot) { source_.attach(slot); });
  frames_->prepareSlots([&camera](rt::DepthFrame& slot) { slot.camera = camera; });
}

void SceneThread::start() {
  stop_ = false;
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "hapticd-scene");
}

void SceneThread::returnUnusedMemory() {
  frames_->prepareSlots([](rt::DepthFrame& slot) {
    const std::size_t used = slot.pixels();
    rt::returnPages(slot.raw + used, (rt::kMaxFramePixels - used) * sizeof slot.raw[0]);
  });
  source_.builder().returnUnusedMemory();
}

void SceneThread::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(wake_mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
  const std::lock_guard lock(tap_mutex_);
  for (const FrameReceiver& receive : std::exchange(frame_requests_, {})) receive(nullptr);
}

void SceneThread::publish() {
  frames_->publish();
  {
    const std::lock_guard lock(wake_mutex_);
    frame_published_ = true;
  }
  wake_.notify_one();
}

/// Waits for a frame or a request for one or, once there is a frame that could be modelled again, until it is
/// time to check the HIP; false if the thread has to end.
bool SceneThread::waitForFrame() {
  std::unique_lock lock(wake_mutex_);
  const auto woken = [this] { return frame_published_ || frame_requested_ || stop_; };
  if (frames_->front().sequence == 0) {
    wake_.wait(lock, woken);
  } else {
    wake_.wait_for(lock, kLookAtHip, woken);
  }
  frame_published_ = false;
  frame_requested_ = false;
  return !stop_;
}

void SceneThread::run() {
  rt::useDefaultFloatingPoint();
  while (waitForFrame()) {
    const bool new_frame = frames_->refresh();
    if (new_frame) {
      countFrame(frames_->front());
      offerToTap(frames_->front());
    }
    modelIfNeeded(new_frame);
    answerFrameRequests();
    showFrame(new_frame);
    if (new_frame) watchDepth();
  }
}

/// Looks at a frame after it was modelled, so that no force waits for it.
void SceneThread::watchDepth() {
  const rt::DepthFrame& frame = frames_->front();
  if (frame.camera != source_.model().parameters()) return;
  const drivers::DepthUse use = drivers::DepthUse::of(frame, source_.model());
  const std::lock_guard lock(camera_mutex_);
  depth_use_.add(use);
}

std::string SceneThread::depthAdvice() const {
  const std::lock_guard lock(camera_mutex_);
  return depth_use_.newest();
}

void SceneThread::setNeeds(const rt::SceneNeeds& needs, std::uint64_t generation) {
  const std::lock_guard lock(requested_mutex_);
  requested_ = {needs, generation};
}

void SceneThread::setTap(FrameTap tap) {
  const std::lock_guard lock(tap_mutex_);
  tap_ = std::move(tap);
  restart_due_ = tap_ != nullptr;
  next_restart_ns_ = 0;
}

void SceneThread::offerToTap(const rt::DepthFrame& frame) {
  const std::lock_guard lock(tap_mutex_);
  if (!tap_) {
    frame_recorded_ = false;
    return;
  }
  frame_recorded_ = tap_(frame);
  restart_due_ = restart_due_ || !frame_recorded_;
  if (!frame_recorded_ || !restart_due_ || frame.arrival_ns < next_restart_ns_) return;
  restart_due_ = false;
  next_restart_ns_ = frame.arrival_ns + kMinRestartInterval_ns;
  source_.builder().forget();
  forgot_ = true;
}

void SceneThread::requestFrame(FrameReceiver receive) {
  {
    const std::lock_guard lock(tap_mutex_);
    if (thread_.joinable()) {
      frame_requests_.push_back(std::move(receive));
      const std::lock_guard wake_lock(wake_mutex_);
      frame_requested_ = true;
      return wake_.notify_one();
    }
  }
  receive(nullptr);
}

void SceneThread::answerFrameRequests() {
  const std::lock_guard lock(tap_mutex_);
  const rt::DepthFrame& frame = frames_->front();
  for (const FrameReceiver& receive : std::exchange(frame_requests_, {})) {
    receive(frame.sequence == 0 ? nullptr : std::make_unique<rt::DepthFrame>(frame));
  }
}

void SceneThread::setView(FrameView view) {
  const std::lock_guard lock(tap_mutex_);
  view_ = std::move(view);
  view_is_new_ = true;
}

void SceneThread::showFrame(bool new_frame) {
  const std::lock_guard lock(tap_mutex_);
  const rt::DepthFrame& frame = frames_->front();
  if (!view_ || frame.sequence == 0) return;
  if (std::exchange(view_is_new_, false) || new_frame) view_(frame);
}

/// Prepares for frames of a camera; false if it cannot be modelled.
bool SceneThread::followCamera(const rt::DepthModelParameters& camera) {
  if (camera == source_.model().parameters()) return true;
  const bool follows = source_.follow(camera);
  const std::lock_guard lock(camera_mutex_);
  camera_ = follows ? camera : camera_;
  if (follows) {
    camera_fault_.clear();
  } else if (const rt::CameraFault fault = rt::faultOf(camera); fault != rt::CameraFault::none) {
    camera_fault_ = "its " + std::string(rt::wordOf(fault)) + " is impossible";
  } else {
    camera_fault_ = "it changed its mode too often; restart hapticd";
  }
  return follows;
}

std::string SceneThread::cameraFault() const {
  const std::lock_guard lock(camera_mutex_);
  return camera_fault_;
}

rt::DepthModelParameters SceneThread::camera() const {
  const std::lock_guard lock(camera_mutex_);
  return camera_;
}

void SceneThread::modelIfNeeded(bool new_frame) {
  const rt::DepthFrame& frame = frames_->front();
  if (frame.sequence == 0 || !followCamera(frame.camera)) return;
  focus_.refresh();
  const rt::Vec3 focus = focus_.front();
  if (!rt::inWorkspace(focus)) return;
  const auto [needs, generation] = [this] {
    const std::lock_guard lock(requested_mutex_);
    return requested_;
  }();
  const double margin = parameters_.max_hip_speed_m_per_s * parameters_.frame_margin_s;
  const double reach = rt::reachOfModel_m(needs, parameters_);
  // early enough to be finished before the HIP leaves the ball
  if (!new_frame && needs.metBy(newest_, focus, margin / 2)) return;

  const std::int64_t begin_ns = rt::monotonicNow_ns();
  rt::Scene& scene = scenes_.back();
  source_.attach(scene);
  source_.builder().build(frame, focus, reach, scene, needs);
  newest_ = scene;
  scenes_.publish();
  const std::int64_t build_ns = rt::monotonicNow_ns() - begin_ns;
  countModel(newest_, new_frame, build_ns);
  recordModel(frame, focus, {reach, generation, begin_ns, build_ns});
}

void SceneThread::recordModel(const rt::DepthFrame& frame, const rt::Vec3& focus_m_in_world,
                              const Build& build) {
  trace::ModelRecord record;
  record.model = newest_.model;
  record.time_ns = build.begin_ns;
  record.build_ns = build.build_ns;
  record.frame = frame.sequence;
  record.frame_time_ns = frame.arrival_ns;
  record.device_ticks = frame.device_ticks;
  record.centre_m_in_world = focus_m_in_world;
  record.radius_m = build.reach_m;
  record.generation = build.generation;
  record.forgot = std::exchange(forgot_, false);
  record.depth_recorded = frame_recorded_;
  record.points = newest_.points;
  record.points_over_capacity = newest_.points_over_capacity;
  const SceneStatus status = this->status();
  record.frames = status.frames;
  record.skipped_frames = status.skipped_frames;
  models_->push(record);
}

void SceneThread::countFrame(const rt::DepthFrame& frame) {
  const std::lock_guard lock(status_mutex_);
  ++status_.frames;
  if (last_sequence_ != 0 && frame.sequence > last_sequence_) {
    status_.skipped_frames += frame.sequence - last_sequence_ - 1;
    const double period_s = static_cast<double>(frame.arrival_ns - last_arrival_ns_) * 1e-9 /
                            static_cast<double>(frame.sequence - last_sequence_);
    if (period_s > 0) {
      const double rate_hz = 1 / period_s;
      const double weight = status_.frame_rate_hz == 0 ? 1 : 1 / kFramesOfMean;
      status_.frame_rate_hz += weight * (rate_hz - status_.frame_rate_hz);
    }
  }
  last_sequence_ = frame.sequence;
  last_arrival_ns_ = frame.arrival_ns;
}

void SceneThread::countModel(const rt::Scene& scene, bool new_frame, std::int64_t model_ns) {
  const std::lock_guard lock(status_mutex_);
  ++status_.models;
  status_.remodels += new_frame ? 0 : 1;
  status_.points = scene.points;
  status_.points_over_capacity += scene.points_over_capacity;
  status_.last_model_ns = model_ns;
  status_.ball = std::isfinite(scene.ball_radius_m)
                     ? std::optional(Ball{scene.ball_centre_m_in_world, scene.ball_radius_m})
                     : std::nullopt;
}

SceneStatus SceneThread::status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

}  // namespace hapticd::daemon
