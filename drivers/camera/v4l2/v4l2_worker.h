// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_status_board.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/capture_stream.h"
#include "drivers/camera/v4l2/video_devices.h"

namespace hapticd::drivers {

/// The driver's thread function and its state: searches for the camera, delivers its frames, and starts again
/// when it is lost. Owned jointly by the thread and the driver, because the kernel takes up to 5 s for a
/// control that a camera does not answer, and the driver does not wait that long.
class V4l2Worker {
 public:
  V4l2Worker(config::CameraSettings settings, std::shared_ptr<SystemCalls> calls, std::filesystem::path root,
             FrameSink& sink)
      : settings_(std::move(settings)), calls_(std::move(calls)), root_(std::move(root)), sink_(sink) {}

  /// Runs until requestStop().  Thread: the driver's own, which ends with it.
  void run();
  /// Asks run() to end, after which the sink is no longer accessed.
  void requestStop();
  /// Returns the current state.  Thread: any.
  CameraStatus status() const { return board_.snapshot(); }

 private:
  using Clock = std::chrono::steady_clock;
  struct Metadata;

  /// A camera's node with depth.
  struct Chosen {
    VideoDevice video;
    std::unique_ptr<OpenDevice> device;
    Capability capability;
  };

  base::Result<void> useCameraOnce();
  void show(const base::Result<void>& used);
  base::Result<Chosen> chosenDevice();
  std::unique_ptr<Metadata> startedMetadata(const Chosen& camera);
  base::Result<void> deliver(const Chosen& camera, const StreamFormat& format,
                             const rt::DepthModelParameters& model, std::string advice);
  base::Result<void> takeUntilLost(const OpenDevice& device, CaptureStream& stream,
                                   const StreamFormat& format, const rt::DepthModelParameters& model,
                                   Metadata* metadata);
  base::Result<void> takeFrames(CaptureStream& stream, const StreamFormat& format,
                                const rt::DepthModelParameters& model, Metadata* metadata);
  void countLostBefore(std::uint32_t sequence);
  void publish(const FilledBuffer& buffer, const StreamFormat& format, const rt::DepthModelParameters& model,
               Metadata* metadata);

  const config::CameraSettings settings_;
  const std::shared_ptr<SystemCalls> calls_;
  const std::filesystem::path root_;
  FrameSink& sink_;
  CameraStatusBoard board_;
  StopSignal stop_signal_;
  bool seen_ = false;                           // run() only: the camera has been found before
  std::uint64_t published_ = 0;                 // run() only
  Clock::time_point last_frame_;                // run() only
  std::optional<std::uint32_t> last_sequence_;  // run() only, of this stream

  std::mutex mutex_;
  bool stop_requested_ = false;
};

}  // namespace hapticd::drivers
