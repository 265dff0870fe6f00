// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "config/settings/driver_rows.h"
#include "drivers/camera/camera_worker.h"

namespace hapticd::drivers {

/// Driver of a Kinect v1 through libfreenect, depth only: libfreenect writes 11-bit raw disparities straight
/// into the sink's frame. While the camera is absent or lost, the driver searches for it once a second.
///
/// stop() waits at most `stop_limit` for a thread that hangs in libfreenect (see FreenectSession). The thread
/// is then abandoned together with the data it still needs; it no longer accesses the sink and ends when
/// libfreenect returns, if ever. With the player fakenect, stop() waits for the next recorded frame.
class FreenectCamera final : public WorkerCamera {
 public:
  explicit FreenectCamera(const std::string& serial,
                          std::chrono::milliseconds stop_limit = std::chrono::milliseconds(3000));
};

inline constexpr config::CameraDriver kFreenectCamera{.word = "freenect",
                                                      .help = "a Kinect v1 on USB, through libfreenect"};

std::unique_ptr<Camera> makeFreenectCamera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers
