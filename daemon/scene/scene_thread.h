// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/solids/solid_file.h"
#include "daemon/base/box.h"
#include "daemon/trace/format/records.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/depth_use.h"
#include "drivers/camera/scene_source.h"
#include "rt/base/parameters.h"
#include "rt/channels/spsc_ring.h"
#include "rt/channels/triple_buffer.h"
#include "rt/depth/depth_frame.h"
#include "rt/fixtures/moving_frame.h"
#include "rt/modelling/scene_builder.h"
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

/// Builds scenes around the HIP from camera frames, and models the newest frame again if the HIP leaves the
/// modelled ball before the next frame arrives. The camera writes its frames through this sink; the force
/// thread takes the scenes from the channel.
class SceneThread final : public drivers::FrameSink {
 public:
  /// All references outlive the thread. `focus_m_in_world`: the point around which the force loop needs the
  /// scene.
  /// `camera`: that of the frames, unless the driver states another one in them.
  SceneThread(const rt::DepthModelParameters& camera, const rt::PoseParameters& T_world_camera,
              const rt::GridParameters& parameters, const rt::SceneNeeds& needs, rt::SceneChannel& scenes,
              rt::TripleBuffer<rt::Vec3>& focus_m_in_world);
  ~SceneThread() override { stop(); }
  SceneThread(const SceneThread&) = delete;
  SceneThread& operator=(const SceneThread&) = delete;

  void start();
  /// Ends the thread; does nothing if it was not started.
  void stop();

  /// Returns memory that only this thread and the camera's use to the system until it is used: the part of
  /// the frames that images of the configured camera leave free, and working memory of the builder. To be
  /// called after memory is locked and before the camera starts.
  void returnUnusedMemory();

  /// Sets what the force law in use reads, from a generation of the Directive on. The newest frame is
  /// modelled again if its model lacks something of that. Thread: any.
  void setNeeds(const rt::SceneNeeds& needs, std::uint64_t generation);

  /// Receives each frame before it is modelled; must not block. Returns false if it could not take the frame.
  using FrameTap = std::function<bool(const rt::DepthFrame&)>;
  /// Passes all frames from the next one on to `tap`, and makes the scenes depend on these frames alone:
  /// filter and fusion restart with the first frame that the tap takes, and with the first one that it takes
  /// after a frame that it refused, but at most once per kMinRestartInterval_ns, because a restart disturbs
  /// the force. An empty `tap` ends this; the previous tap is not called after this function returns. Thread:
  /// any.
  void setTap(FrameTap tap);

  static constexpr std::int64_t kMinRestartInterval_ns = 10'000'000'000;

  /// Receives a copy of the newest frame; null if there is none or the thread ends.
  using FrameReceiver = std::function<void(std::unique_ptr<rt::DepthFrame>)>;
  /// Requests a copy of the newest frame. Thread: any; `receive` is called by the scene thread, or by the
  /// thread that stops it.
  void requestFrame(FrameReceiver receive);

  /// Receives each new frame after it is modelled, and the newest one soon after setView(); must not block.
  using FrameView = std::function<void(const rt::DepthFrame&)>;
  /// Passes frames on to `view`; the view before is not called after this function returns. An empty `view`
  /// ends this. It has no effect on the scenes. Thread: any.
  void setView(FrameView view);

  /// A record of every scene that is built. Thread of pop(): one.
  using ModelRing = rt::SpscRing<trace::ModelRecord, 1024>;
  ModelRing& models() noexcept { return *models_; }

  std::size_t pointCapacity() const noexcept { return source_.builder().pointCapacity(); }
  /// The camera of the newest modelled frame, or the configured one before. Thread: any.
  rt::DepthModelParameters camera() const;
  /// Why the newest frame's camera cannot be modelled, in words; empty: it can. Thread: any.
  std::string cameraFault() const;
  /// What is wrong with the depth of the newest frames, in words with a remedy; empty: nothing. Thread: any.
  std::string depthAdvice() const;
  /// The current counters. Thread: any.
  SceneStatus status() const;

  rt::DepthFrame& back() override { return frames_->back(); }
  void publish() override;

 private:
  void run();
  bool waitForFrame();
  void offerToTap(const rt::DepthFrame& frame);
  void answerFrameRequests();
  void showFrame(bool new_frame);
  void watchDepth();
  bool followCamera(const rt::DepthModelParameters& camera);
  void modelIfNeeded(bool new_frame);
  /// For which focus and how fast a scene was built.
  struct Build {
    double reach_m;
    std::uint64_t generation;
    std::int64_t begin_ns;
    std::int64_t build_ns;
  };
  void recordModel(const rt::DepthFrame& frame, const rt::Vec3& focus_m_in_world, const Build& build);
  void countFrame(const rt::DepthFrame& frame);
  void countModel(const rt::Scene& scene, bool new_frame, std::int64_t model_ns);

  const rt::GridParameters parameters_;
  rt::SceneChannel& scenes_;
  rt::TripleBuffer<rt::Vec3>& focus_;
  drivers::SceneSource source_;
  std::unique_ptr<rt::FrameChannel> frames_;
  rt::Scene newest_;  // a view of the last published scene, only to know what it covers
  std::unique_ptr<ModelRing> models_;

  struct Requested {
    rt::SceneNeeds needs;
    std::uint64_t generation = 0;
  };
  mutable std::mutex camera_mutex_;
  rt::DepthModelParameters camera_;
  std::string camera_fault_;
  drivers::DepthUseWatch depth_use_;

  mutable std::mutex requested_mutex_;
  Requested requested_;

  std::mutex tap_mutex_;
  FrameTap tap_;
  bool restart_due_ = false;  // restart filter and fusion with the next frame that the tap takes
  std::int64_t next_restart_ns_ = 0;
  std::vector<FrameReceiver> frame_requests_;
  FrameView view_;
  bool view_is_new_ = false;

  // The next two describe the newest frame; scene thread only.
  bool frame_recorded_ = false;
  bool forgot_ = false;

  std::mutex wake_mutex_;
  std::condition_variable wake_;
  bool frame_published_ = false;
  bool frame_requested_ = false;
  bool stop_ = false;

  mutable std::mutex status_mutex_;
  SceneStatus status_;
  std::uint64_t last_sequence_ = 0;
  std::int64_t last_arrival_ns_ = 0;

  std::thread thread_;
};

}  // namespace hapticd::daemon
