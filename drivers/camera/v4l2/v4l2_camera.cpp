// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/v4l2_camera.h"

#include <utility>

#include "drivers/base/start_thread.h"

namespace hapticd::drivers {

base::Result<void> V4l2Camera::start(FrameSink& sink) {
  return thread_.start(std::make_shared<V4l2Worker>(settings_, calls_, root_, sink), "v4l2",
                       [](auto body) { return startThread("camera", std::move(body)); });
}

void V4l2Camera::stop() {
  thread_.stop(kStopLimit);
}

CameraStatus V4l2Camera::status() const {
  return thread_.status("v4l2");
}

std::unique_ptr<Camera> makeV4l2Camera(const config::CameraSettings& settings) {
  return std::make_unique<V4l2Camera>(settings);
}

}  // namespace hapticd::drivers
