// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/base/start_thread.h"
#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// Runs a camera driver's worker in a thread that can be abandoned while it hangs in a library or in the
/// kernel: thread and worker share the data that either still needs.
///
/// `Worker` has `void run()`, which ends after `bool stop(std::chrono::milliseconds limit)`; stop() returns
/// false if run() has not ended within the limit, and from then on run() does not access the sink. It also
/// has `CameraStatus status() const`. Thread: status() any; the rest one.
template <typename Worker>
class WorkerThread {
 public:
  /// Starts `worker`. `driver`: the name of the driver, for errors.
  config::Result<void> start(std::shared_ptr<Worker> worker, std::string_view driver) {
    if (thread_.joinable())
      return std::unexpected(config::Error{std::string(driver), "is already running", ""});
    auto thread = startThread("camera", [worker] { worker->run(); });
    if (!thread) return std::unexpected(thread.error());
    const std::lock_guard lock(worker_mutex_);
    worker_ = std::move(worker);
    thread_ = std::move(*thread);
    return {};
  }

  /// Ends the thread, or abandons it after `limit`. Does nothing if it was not started.
  void stop(std::chrono::milliseconds limit) {
    if (!thread_.joinable()) return;
    if (worker_->stop(limit)) {
      thread_.join();
    } else {
      thread_.detach();
    }
  }

  /// Returns the worker's status, also after stop(); before start() one with this identity.
  CameraStatus status(std::string identity) const {
    const std::lock_guard lock(worker_mutex_);
    if (worker_) return worker_->status();
    CameraStatus status;
    status.identity = std::move(identity);
    status.detail = "not started";
    return status;
  }

 private:
  mutable std::mutex worker_mutex_;
  std::shared_ptr<Worker> worker_;
  std::thread thread_;
};

}  // namespace hapticd::drivers
