// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_status_board.h"
#include "drivers/camera/recorded/recording_reader.h"

namespace hapticd::drivers {

/// Plays a recording by the host times of its frames, at `speed` times real time. Every readable frame is
/// delivered; a damaged one, and a last line of the index that was cut off, is counted and skipped. At the
/// end it restarts one frame period later (`loop`), or the camera is lost. Where the recording states
/// exposures, each frame keeps its time from the exposure to the arrival.
class RecordedCamera final : public Camera {
 public:
  /// `limits`: accepted depths of a camera that the recording describes.
  RecordedCamera(std::filesystem::path folder, bool loop, double speed, const DepthLimits& limits = {})
      : folder_(std::move(folder)), loop_(loop), speed_(speed), limits_(limits) {}
  ~RecordedCamera() override { stop(); }

  /// Errors: the folder is not a recording, the speed is not above zero.
  base::Result<void> start(FrameSink& sink) override;
  void stop() override;
  CameraStatus status() const override { return board_.snapshot(); }

 private:
  void play(FrameSink& sink);
  bool playOnce(FrameSink& sink, std::chrono::steady_clock::time_point begin);
  std::chrono::nanoseconds scaled(std::int64_t recorded_ns) const;
  std::chrono::nanoseconds lengthOfOnePass() const;

  std::filesystem::path folder_;
  bool loop_;
  double speed_;
  DepthLimits limits_;
  std::optional<RecordingReader> reader_;
  CameraStatusBoard board_;
  StopSignal stop_signal_;
  std::uint64_t published_ = 0;  // playing thread only
  std::string last_fault_;       // playing thread only: of a damaged frame
  std::thread thread_;
};

}  // namespace hapticd::drivers
