// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>

#include "drivers/base/worker_thread.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/v4l2/v4l2_worker.h"

namespace hapticd::drivers {

/// Driver of depth cameras that the kernel drives (formats Z16 and Y16), without a vendor's library. While
/// the camera is absent or lost, the driver searches for it once a second. stop() waits at most `kStopLimit`
/// for a thread that waits in the kernel for a camera's answer; the thread then ends by itself.
class V4l2Camera final : public Camera {
 public:
  static constexpr std::chrono::milliseconds kStopLimit{3000};

  explicit V4l2Camera(config::CameraSettings settings,
                      std::shared_ptr<SystemCalls> calls = std::make_shared<KernelCalls>(),
                      std::filesystem::path root = "/")
      : settings_(std::move(settings)), calls_(std::move(calls)), root_(std::move(root)) {}
  ~V4l2Camera() override { stop(); }

  base::Result<void> start(FrameSink& sink) override;
  void stop() override;
  CameraStatus status() const override;

 private:
  config::CameraSettings settings_;
  std::shared_ptr<SystemCalls> calls_;
  std::filesystem::path root_;
  WorkerThread<V4l2Worker> thread_;
};

}  // namespace hapticd::drivers
