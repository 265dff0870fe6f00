// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/error.h"
#include "drivers/base/start_thread.h"
#include "drivers/base/stop_signal.h"
#include "drivers/base/worker_thread.h"
#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// A camera's status board, with the counting of frames that all cameras share.
/// Thread: any.  Progress: blocking, for as long as a string is copied.  RT: not safe.
class CameraStatusBoard : public StatusBoard<CameraStatus> {
 public:
  void setIdentity(std::string identity) {
    update([&](CameraStatus& status) { status.identity = std::move(identity); });
  }

  void setAdvice(std::string advice) {
    update([&](CameraStatus& status) { status.advice = std::move(advice); });
  }

  /// Counts a published frame; a camera that delivers is streaming. Returns the frame's number, 1 for the
  /// first.
  std::uint64_t countFrame() {
    return update([](CameraStatus& status) {
      if (status.state != CameraState::streaming) {
        status.state = CameraState::streaming;
        if (!status.detail.starts_with(kDamage)) status.detail.clear();
      }
      return ++status.frames;
    });
  }

  /// Counts a frame that was not published because of `why`.
  void countDamagedFrame(std::string why) {
    update([&](CameraStatus& status) {
      ++status.damaged_frames;
      status.detail = std::string(kDamage) + std::move(why);
    });
  }

  /// Counts frames that are missing before one that arrived. `detail`: for people
  void countLostFrames(std::uint32_t count, std::string detail) {
    update([&](CameraStatus& status) {
      status.lost_frames += count;
      status.detail = std::move(detail);
    });
  }

 private:
  static constexpr std::string_view kDamage = "the last damaged frame: ";
};

/// What the thread of a camera does: it looks for the camera once a second, delivers its frames, and starts
/// over when it is lost. Owned jointly by the thread and the driver, because a thread that hangs in a library
/// or in the kernel may outlive the driver.
class CameraWorker {
 public:
  virtual ~CameraWorker() = default;

  /// Runs until requestStop().  Thread: the driver's own, which ends with it.
  void run() {
    using Clock = std::chrono::steady_clock;
    board_.set(CameraState::absent, kLookingForCamera);
    board_.setIdentity(identity_);
    for (auto next_try = Clock::now(); !stop_signal_.waitUntil(next_try);
         next_try = Clock::now() + std::chrono::seconds(1)) {
      show(useCamera());
    }
  }
  /// Asks run() to end; on return the sink is no longer accessed.  Thread: any except the driver's own.
  virtual void requestStop() = 0;
  /// Returns the current state.  Thread: any.
  virtual CameraStatus status() const { return board_.snapshot(); }

 protected:
  explicit CameraWorker(std::string identity) : identity_(std::move(identity)) {}

  /// Opens the camera and delivers its frames until it is lost or a stop is requested.
  /// Errors: why it is not there, or not any longer.
  virtual base::Result<void> useCamera() = 0;
  /// Shows why the camera cannot be used, if it cannot.
  void show(const base::Result<void>& used) {
    if (used || stop_signal_.raised()) return;
    board_.set(seen_ ? CameraState::lost : CameraState::absent, used.error().text());
  }

  CameraStatusBoard board_;
  StopSignal stop_signal_;
  bool seen_ = false;  // run() only: the camera has been found before

 private:
  const std::string identity_;
};

/// A camera whose CameraWorker runs in a thread of its own.
class WorkerCamera : public Camera {
 public:
  struct Kind {
    std::string name;                      ///< of the driver, for errors
    std::string identity;                  ///< before the start
    std::chrono::milliseconds stop_limit;  ///< after which a thread that does not end is abandoned
    std::function<std::shared_ptr<CameraWorker>(FrameSink& sink)> make;  ///< a worker for one start
  };

  explicit WorkerCamera(Kind kind) : kind_(std::move(kind)) {}
  ~WorkerCamera() override { stop(); }

  base::Result<void> start(FrameSink& sink) final {
    return thread_.start(kind_.make(sink), kind_.name,
                         [](auto body) { return startThread("camera", std::move(body)); });
  }
  void stop() final { thread_.stop(kind_.stop_limit); }
  CameraStatus status() const final { return thread_.status(kind_.identity); }

 private:
  const Kind kind_;
  WorkerThread<CameraWorker> thread_;
};

}  // namespace hapticd::drivers
