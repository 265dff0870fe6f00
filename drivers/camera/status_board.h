// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// The state of a camera, written by its driver's thread and read by others.
/// Thread: any.  Progress: blocking, for as long as a string is copied.  RT: not safe.
class StatusBoard {
 public:
  void set(CameraState state, std::string detail) {
    const std::lock_guard lock(mutex_);
    status_.state = state;
    status_.detail = std::move(detail);
  }

  /// A new start: nothing delivered, nothing found yet.
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

  /// A frame was published; a camera that delivers is streaming. Returns the frame's number, 1 for the first.
  std::uint64_t countFrame() {
    const std::lock_guard lock(mutex_);
    if (status_.state != CameraState::streaming) {
      status_.state = CameraState::streaming;
      status_.detail.clear();
    }
    return ++status_.frames;
  }

  /// A frame was not published because of `why`.
  void countDamagedFrame(std::string why) {
    const std::lock_guard lock(mutex_);
    ++status_.damaged_frames;
    status_.detail = "the last damaged frame: " + std::move(why);
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
