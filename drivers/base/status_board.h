// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <mutex>
#include <string>
#include <utility>

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

}  // namespace hapticd::drivers
