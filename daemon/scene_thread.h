#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/box.h"
#include "drivers/camera/camera.h"
#include "rt/depth_model.h"
#include "rt/scene_builder.h"

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

  /// What the force law in use reads; the newest frame is modelled again if its model does not hold it.
  /// Thread: any.
  void setNeeds(const rt::SceneNeeds& needs);

  std::size_t pointCapacity() const noexcept { return builder_.pointCapacity(); }
  /// Thread: any.
  SceneStatus status() const;

  rt::DepthFrame& back() override { return frames_->back(); }
  void publish() override;

 private:
  void run();
  bool waitForFrame();
  void modelIfNeeded(bool new_frame);
  rt::SceneNeeds needs() const;
  void countFrame(const rt::DepthFrame& frame);
  void countModel(const rt::Scene& scene, bool new_frame, std::int64_t model_ns);

  const rt::GridParameters parameters_;
  rt::SceneChannel& scenes_;
  rt::TripleBuffer<rt::Vec3>& focus_;
  rt::SceneBuilder builder_;
  std::vector<rt::SceneStorage> storage_;
  std::unique_ptr<rt::FrameChannel> frames_;
  rt::Scene newest_;  // a view of the last published scene, for what it covers only
  mutable std::mutex needs_mutex_;
  rt::SceneNeeds needs_;

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
