// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "config/base/error.h"

namespace hapticd::drivers {

/// A mutex whose holder inherits the priority of the most urgent waiting thread, so that a real-time thread
/// does not wait for whatever preempts a holder of normal priority.
/// Thread: any.  Progress: blocking.  RT: not safe.
class PriorityInheritingMutex {
 public:
  PriorityInheritingMutex() {
    pthread_mutexattr_t attributes;
    ::pthread_mutexattr_init(&attributes);
    ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    ::pthread_mutex_init(&mutex_, &attributes);
    ::pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityInheritingMutex() { ::pthread_mutex_destroy(&mutex_); }
  PriorityInheritingMutex(const PriorityInheritingMutex&) = delete;
  PriorityInheritingMutex& operator=(const PriorityInheritingMutex&) = delete;

  // Interface required by std::lock_guard.
  void lock() { ::pthread_mutex_lock(&mutex_); }
  void unlock() { ::pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

/// The status of a device, written by its driver's thread and read by others. A driver with a fast loop keeps
/// its counts to itself and hands them over with update() a few times a second.
/// `Status`: CameraStatus or HandleStatus; its members `state`, `detail` and `identity` are used here.
/// Thread: any.  Progress: blocking, for as long as a string is copied.  RT: not safe.
template <typename Status>
class StatusBoard {
 public:
  using State = decltype(Status::state);

  /// Calls `change` with a reference to the status, while nobody else reads or writes it.
  template <typename Change>
  auto update(Change change) {
    const std::lock_guard lock(mutex_);
    return change(status_);
  }

  void set(State state, std::string detail) {
    update([&](Status& status) {
      status.state = state;
      status.detail = std::move(detail);
    });
  }

  /// Resets the status for a new start of the driver.
  void reset(std::string identity) {
    update([&](Status& status) {
      status = Status{};
      status.identity = std::move(identity);
    });
  }

  Status snapshot() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

 private:
  mutable PriorityInheritingMutex mutex_;
  Status status_;
};

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

  /// Ends the thread, or abandons it after `limit`; without one it waits. Does nothing if it was not started.
  void stop(std::optional<std::chrono::milliseconds> limit) {
    if (!thread_.joinable()) return;
    worker_->requestStop();
    const bool ended = !limit || ends_.wait_for(*limit) == std::future_status::ready;
    ended ? thread_.join() : thread_.detach();
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
