// SPDX-License-Identifier: Apache-2.0
#include "daemon/scene/depth_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/base/start_thread.h"
#include "rt/depth/depth_model.h"

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

}  // namespace hapticd::daemon
