// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/freenect_camera.h"

#include <utility>

#include "drivers/base/start_thread.h"

namespace hapticd::drivers {

base::Result<void> FreenectCamera::start(FrameSink& sink) {
  return thread_.start(std::make_shared<FreenectWorker>(serial_, sink), "freenect",
                       [](auto body) { return startThread("camera", std::move(body)); });
}

void FreenectCamera::stop() {
  thread_.stop(stop_limit_);
}

CameraStatus FreenectCamera::status() const {
  return thread_.status(serial_.empty() ? "freenect" : "freenect " + serial_);
}

std::unique_ptr<Camera> makeFreenectCamera(const config::CameraSettings& settings) {
  return std::make_unique<FreenectCamera>(settings.serial);
}

}  // namespace hapticd::drivers
