// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// State of a camera, written by its driver's thread and read by other threads.
/// Thread: any.  Progress: blocking while a string is copied.  RT: not safe.
class StatusBoard {
 public:
  void set(CameraState state, std::string detail) {
    const std::lock_guard lock(mutex_);
    status_.state = state;
    status_.detail = std::move(detail);
  }

  /// Resets everything for a new start.
  void reset(std::string identity) {
    const std::lock_guard lock(mutex_);
    status_ = CameraStatus{};
    status_.identity = std::move(identity);
  }

  void setIdentity(std::string identity) {
    const std::lock_guard lock(mutex_);
    status_.identity = std::move(identity);
  }

  void setAdvice(std::string advice) {
    const std::lock_guard lock(mutex_);
    status_.advice = std::move(advice);
  }

  /// Counts a published frame and sets the state to streaming. Returns the frame's number, starting at 1.
  std::uint64_t countFrame() {
    const std::lock_guard lock(mutex_);
    if (status_.state != CameraState::streaming) {
      status_.state = CameraState::streaming;
      status_.detail.clear();
    }
    return ++status_.frames;
  }

  /// Counts a frame that was not published; `why` is shown to people.
  void countDamagedFrame(std::string why) {
    const std::lock_guard lock(mutex_);
    ++status_.damaged_frames;
    status_.detail = "last damaged frame: " + std::move(why);
  }

  CameraStatus snapshot() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

 private:
  mutable std::mutex mutex_;
  CameraStatus status_;
};

}  // namespace hapticd::drivers
