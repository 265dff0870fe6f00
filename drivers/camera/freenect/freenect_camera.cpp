// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/freenect/freenect_camera.h"

#include "drivers/base/start_thread.h"

namespace hapticd::drivers {

config::Result<void> FreenectCamera::start(FrameSink& sink) {
  if (thread_.joinable()) return std::unexpected(config::Error{"freenect", "is already running", ""});
  const auto worker = std::make_shared<FreenectWorker>(serial_, sink);
  auto thread = startThread("camera", [worker] { worker->run(); });
  if (!thread) return std::unexpected(thread.error());
  const std::lock_guard lock(worker_mutex_);
  worker_ = worker;
  thread_ = std::move(*thread);
  return {};
}

void FreenectCamera::stop() {
  if (!thread_.joinable()) return;
  if (worker_->stop(stop_limit_)) {
    thread_.join();
  } else {
    thread_.detach();
  }
}

CameraStatus FreenectCamera::status() const {
  const std::lock_guard lock(worker_mutex_);
  if (worker_) return worker_->status();
  CameraStatus status;
  status.identity = serial_.empty() ? "freenect" : "freenect " + serial_;
  status.detail = "not started";
  return status;
}

}  // namespace hapticd::drivers
