// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_status_board.h"
#include "drivers/camera/freenect/freenect_session.h"

namespace hapticd::drivers {

/// The driver's thread function and its state: searches for the camera, delivers its frames, and restarts
/// when it is lost. Owned jointly by the thread and the driver, because a thread that hangs in libfreenect
/// outlives the driver. Such a thread holds no memory of the sink: the sink is lent to libfreenect only while
/// frames are processed, where libfreenect does not hang, and never again after a stop was requested.
class FreenectWorker {
 public:
  FreenectWorker(std::string serial, FrameSink& sink) : serial_(std::move(serial)), sink_(sink) {}

  /// Runs until requestStop().  Thread: the driver's own, which ends with it.
  void run();

  /// Asks run() to end, and waits until the sink is no longer accessed.  Thread: any except the driver's own.
  void requestStop();

  /// Returns the current state.  Thread: any.
  CameraStatus status() const;

 private:
  using Clock = std::chrono::steady_clock;

  void useCameraOnce();
  void deliver(FreenectSession& session);
  std::uint16_t* takeFrame(const std::optional<std::string>& damage, std::uint32_t device_ticks);
  std::string adviceOn(const FreenectSession& session) const;
  void reportMissing(const base::Error& error);
  void enterLibfreenect();
  bool lendSink();
  void returnSink();

  const std::string serial_;
  FrameSink& sink_;
  CameraStatusBoard board_;
  StopSignal stop_signal_;
  std::atomic<std::int64_t> in_libfreenect_since_ns_{0};  // 0: not in a call that may hang
  bool seen_ = false;                                     // run() only: the camera has been found before
  std::uint64_t published_ = 0;                           // run() only
  Clock::time_point last_frame_;                          // run() only

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_requested_ = false;
  bool sink_lent_ = false;
};

}  // namespace hapticd::drivers
