// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "config/settings/driver_rows.h"
#include "drivers/base/worker_thread.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/freenect/freenect_worker.h"

namespace hapticd::drivers {

/// Driver of a Kinect v1 through libfreenect, depth only: libfreenect writes 11-bit raw disparities straight
/// into the sink's frame. While the camera is absent or lost, the driver searches for it once a second.
///
/// stop() waits at most `stop_limit` for a thread that hangs in libfreenect (see FreenectSession). The thread
/// is then abandoned together with the data it still needs; it no longer accesses the sink and ends when
/// libfreenect returns, if ever. With the player fakenect, stop() waits for the next recorded frame.
class FreenectCamera final : public Camera {
 public:
  static constexpr std::chrono::milliseconds kStopLimit{3000};

  explicit FreenectCamera(std::string serial, std::chrono::milliseconds stop_limit = kStopLimit)
      : serial_(std::move(serial)), stop_limit_(stop_limit) {}
  ~FreenectCamera() override { stop(); }

  base::Result<void> start(FrameSink& sink) override;
  void stop() override;
  CameraStatus status() const override;

 private:
  std::string serial_;
  std::chrono::milliseconds stop_limit_;
  WorkerThread<FreenectWorker> thread_;
};

inline constexpr config::CameraDriver kFreenectCamera{.word = "freenect",
                                                      .help = "a Kinect v1 on USB, through libfreenect"};

std::unique_ptr<Camera> makeFreenectCamera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers
