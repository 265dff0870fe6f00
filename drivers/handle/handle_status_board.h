// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "drivers/base/priority_inheriting_mutex.h"
#include "drivers/handle/handle.h"

namespace hapticd::drivers {

/// The state of a handle, written by its driver's thread and read by others. Counting does not wait: the
/// driver's thread keeps its counts and hands them over with update() a few times a second.
/// Thread: any.  Progress: blocking, for as long as a string is copied.  RT: not safe.
class HandleStatusBoard {
 public:
  /// `change`: takes a HandleStatus&.
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

  /// A new start: nothing measured, nothing found yet.
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
