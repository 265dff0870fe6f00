// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "config/base/error.h"

namespace hapticd::drivers {

/// Runs a driver's worker in a thread that can be abandoned while it hangs in a library or in the kernel:
/// thread and worker share the data that either still needs.
///
/// `Worker` has `void run()`, which ends after `void requestStop()`, `Status status() const` with the status
/// of a camera or a handle. From requestStop() on it accesses neither the sink nor the channels of the
/// driver. Thread: status() any; the rest one.
template <typename Worker>
class WorkerThread {
 public:
  using Status = decltype(std::declval<const Worker&>().status());

  /// Starts `worker`. `driver`: the name of the driver, for errors. `start_thread`: makes a thread of a body.
  template <typename StartThread>
  base::Result<void> start(std::shared_ptr<Worker> worker, std::string_view driver,
                           StartThread start_thread) {
    if (thread_.joinable())
      return std::unexpected(base::Error{std::string(driver), "is already running", ""});
    std::promise<void> ended;
    auto ends = ended.get_future();
    auto thread = start_thread([worker, ended = std::move(ended)]() mutable {
      worker->run();
      ended.set_value();
    });
    if (!thread) return std::unexpected(thread.error());
    const std::lock_guard lock(worker_mutex_);
    worker_ = std::move(worker);
    thread_ = std::move(*thread);
    ends_ = std::move(ends);
    return {};
  }

  /// Ends the thread, or abandons it after `limit`. Does nothing if it was not started.
  void stop(std::chrono::milliseconds limit) {
    if (!thread_.joinable()) return;
    worker_->requestStop();
    ends_.wait_for(limit) == std::future_status::ready ? thread_.join() : thread_.detach();
  }

  /// Returns the worker's status, also after stop(); before start() one with this identity.
  Status status(std::string identity) const {
    const std::lock_guard lock(worker_mutex_);
    if (worker_) return worker_->status();
    Status status;
    status.identity = std::move(identity);
    status.detail = "not started";
    return status;
  }

 private:
  mutable std::mutex worker_mutex_;
  std::shared_ptr<Worker> worker_;
  std::thread thread_;
  std::future<void> ends_;
};

}  // namespace hapticd::drivers
