// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "drivers/base/priority_inheriting_mutex.h"

namespace hapticd::drivers {

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
