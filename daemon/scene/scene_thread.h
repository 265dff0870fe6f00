// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/base/box.h"
#include "drivers/camera/camera.h"
#include "drivers/trace/records.h"
#include "rt/depth_model.h"
#include "rt/scene_builder.h"
#include "rt/spsc_ring.h"

namespace hapticd::daemon {

/// Turns camera frames into scenes around the HIP, and models the newest frame again when the HIP leaves the
/// modelled ball before the next frame comes. The camera puts its frames in here; the force thread takes the
/// scenes out of the channel.
class SceneThread final : public drivers::FrameSink {
 public:
  /// All references outlive the thread. `focus_m_in_world`: where the force loop needs the scene modelled.
  SceneThread(const rt::DepthModel& model, const rt::GridParameters& parameters, const rt::SceneNeeds& needs,
              rt::SceneChannel& scenes, rt::TripleBuffer<rt::Vec3>& focus_m_in_world);
  ~SceneThread() override { stop(); }
  SceneThread(const SceneThread&) = delete;
  SceneThread& operator=(const SceneThread&) = delete;

  void start();
  /// Harmless when not started.
  void stop();

  /// What the force law in use reads, from a generation of the Directive on; the newest frame is modelled
  /// again if its model does not hold it. Thread: any.
  void setNeeds(const rt::SceneNeeds& needs, std::uint64_t generation);

  /// Gets each frame before it is modelled; must not block. False: it could not take the frame.
  using FrameTap = std::function<bool(const rt::DepthFrame&)>;
  /// From the next frame on `tap` gets all frames, and what is modelled depends on these alone: filter and
  /// fusion begin anew with the first one that it takes, and once more with the first one after any that it
  /// did not take, but not more often than every kLeastBetweenBeginnings_ns, for that is felt. Empty: no
  /// more; the tap before is not called after this returns. Thread: any.
  void setTap(FrameTap tap);

  static constexpr std::int64_t kLeastBetweenBeginnings_ns = 10'000'000'000;

  /// Gets a copy of the newest frame; null while there is none, or when the thread ends.
  using FrameReceiver = std::function<void(std::unique_ptr<rt::DepthFrame>)>;
  /// Thread: any, but `receive` is called by the scene thread, or by who stops it.
  void askForFrame(FrameReceiver receive);

  /// Every scene that is built. Thread of pop(): one.
  using ModelRing = rt::SpscRing<drivers::ModelRecord, 1024>;
  ModelRing& models() noexcept { return *models_; }

  std::size_t pointCapacity() const noexcept { return builder_.pointCapacity(); }
  /// Thread: any.
  SceneStatus status() const;

  rt::DepthFrame& back() override { return frames_->back(); }
  void publish() override;

 private:
  void run();
  bool waitForFrame();
  void offerToTap(const rt::DepthFrame& frame);
  void answerFrameRequests();
  void modelIfNeeded(bool new_frame);
  /// How a scene was built.
  struct Build {
    double reach_m;
    std::uint64_t generation;
    std::int64_t begin_ns;
    std::int64_t build_ns;
  };
  void tellModel(const rt::DepthFrame& frame, const rt::Vec3& focus_m_in_world, const Build& build);
  void countFrame(const rt::DepthFrame& frame);
  void countModel(const rt::Scene& scene, bool new_frame, std::int64_t model_ns);

  const rt::GridParameters parameters_;
  rt::SceneChannel& scenes_;
  rt::TripleBuffer<rt::Vec3>& focus_;
  rt::SceneBuilder builder_;
  std::vector<rt::SceneStorage> storage_;
  std::unique_ptr<rt::FrameChannel> frames_;
  rt::Scene newest_;  // a view of the last published scene, for what it covers only
  std::unique_ptr<ModelRing> models_;

  struct Wanted {
    rt::SceneNeeds needs;
    std::uint64_t generation = 0;
  };
  mutable std::mutex wanted_mutex_;
  Wanted wanted_;

  std::mutex tap_mutex_;
  FrameTap tap_;
  bool begin_anew_ = false;  // with the next frame that the tap takes
  std::int64_t next_beginning_ns_ = 0;
  std::vector<FrameReceiver> frame_requests_;

  // Of the newest frame; scene thread only.
  bool frame_recorded_ = false;
  bool forgot_ = false;

  std::mutex wake_mutex_;
  std::condition_variable wake_;
  bool frame_published_ = false;
  bool stop_ = false;

  mutable std::mutex status_mutex_;
  SceneStatus status_;
  std::uint64_t last_sequence_ = 0;
  std::int64_t last_arrival_ns_ = 0;

  std::thread thread_;
};

}  // namespace hapticd::daemon
