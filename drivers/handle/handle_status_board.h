// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "drivers/handle/handle.h"
#include "drivers/priority_inheriting_mutex.h"

namespace hapticd::drivers {

/// State of a handle, written by its driver's thread and read by other threads. The driver's thread counts
/// without locking and passes its counts to update() a few times a second.
/// Thread: any.  Progress: blocking while a string is copied.  RT: not safe.
class HandleStatusBoard {
 public:
  /// Calls `change(HandleStatus&)` under the lock.
  template <typename Change>
  void update(Change change) {
    const std::lock_guard lock(mutex_);
    change(status_);
  }

  void set(HandlePresence state, std::string detail) {
    update([&](HandleStatus& status) {
      status.state = state;
      status.detail = std::move(detail);
    });
  }

  /// Resets everything for a new start.
  void reset(std::string identity) {
    update([&](HandleStatus& status) {
      status = HandleStatus{};
      status.identity = std::move(identity);
    });
  }

  HandleStatus snapshot() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

 private:
  mutable PriorityInheritingMutex mutex_;
  HandleStatus status_;
};

}  // namespace hapticd::drivers
