// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/solids/solid_file.h"
#include "rt/base/parameters.h"
#include "rt/channels/triple_buffer.h"
#include "rt/depth/depth_frame.h"
#include "rt/fixtures/moving_frame.h"
#include "rt/tracking/solid_tracker.h"

namespace hapticd::daemon {

/// A solid that moves with a frame, and by which the depth camera finds that frame.
struct TrackedSolid {
  std::uint32_t frame = 0;  ///< FrameRules::identity
  std::shared_ptr<const config::Solid> solid;
  /// In the frame; at the start the frame is the world.
  rt::SolidPose T_frame_solid;

  friend bool operator==(const TrackedSolid& a, const TrackedSolid& b) {
    return a.frame == b.frame && a.solid == b.solid &&
           a.T_frame_solid.position_m == b.T_frame_solid.position_m &&
           a.T_frame_solid.rotation == b.T_frame_solid.rotation;
  }
};

/// What the newest depth frame showed of a solid.
struct TrackingResult {
  std::uint32_t frame = 0;
  rt::TrackingVerdict verdict = rt::TrackingVerdict::too_few_points;
  double error_m = 0;  ///< expected at the target, three standard deviations
  double share = 0;    ///< Tracking::share
};

/// Finds solids in the depth frames and makes poses of their frames. A thread of normal priority does the
/// work, so that neither force nor scenes wait for it; while it works on a frame, newer ones replace each
/// other. Thread: control thread, unless stated otherwise.
class DepthTracker {
 public:
  explicit DepthTracker(const rt::PoseParameters& T_world_camera);
  ~DepthTracker();
  DepthTracker(const DepthTracker&) = delete;
  DepthTracker& operator=(const DepthTracker&) = delete;

  /// Replaces what is tracked; what was tracked before goes on from its last pose. The thread starts with the
  /// first solid; where the system has none, a later call starts it. To be called again and again.
  void track(std::vector<TrackedSolid> solids);
  /// Whether show() has an effect.
  bool tracks() const { return !solids_.empty(); }
  /// Where the hand is, which may hide a solid.
  void setHip(const rt::Vec3& hip_m_in_world);
  /// Takes a frame.  Thread: one other, such as that of the scene.  Never blocks for long: copies the frame.
  void show(const rt::DepthFrame& frame);

  /// Takes the poses that have been found since the last call.
  std::vector<rt::FramePose> takePoses();
  /// The newest result for a frame; nothing: it is not tracked, or no depth frame has come yet.
  std::optional<TrackingResult> resultOf(std::uint32_t frame) const;

 private:
  /// One solid and what is known of it.
  struct Follower;

  void request(std::vector<TrackedSolid> solids);
  void run();
  bool waitForFrame(std::vector<std::unique_ptr<Follower>>& followers, rt::Vec3& hip_m_in_world);

  const rt::PoseParameters T_world_camera_;
  std::vector<TrackedSolid> solids_;
  std::unique_ptr<rt::TripleBuffer<rt::DepthFrame>> frames_;  // null until something is tracked

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable wake_;
  std::vector<TrackedSolid> requested_;
  rt::Vec3 hip_m_in_world_;
  std::vector<rt::FramePose> poses_;
  std::vector<TrackingResult> results_;
  bool shown_ = false;
  bool stop_ = false;

  std::thread thread_;
};

}  // namespace hapticd::daemon
