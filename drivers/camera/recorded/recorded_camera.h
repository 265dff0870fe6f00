// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_worker.h"
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
  base::Result<void> check() const override;
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

struct RecordedSettings {
  std::string recording;  ///< folder with INDEX.txt or camera.yaml
  bool loop = true;       ///< restart at the end
  double speed = 1;       ///< playback speed relative to real time
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kRecordedRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(camera, RecordedSettings, recording)>(
        "camera.recording", config::Effect::restart, "", {}, "",
        "folder of the recording, for the driver recorded"),
    config::row<HAPTICD_OWN_MEMBER(camera, RecordedSettings, loop)>(
        "camera.loop", config::Effect::restart, "", {}, "",
        "restart the recording at its end, for the driver recorded"),
    config::row<HAPTICD_OWN_MEMBER(camera, RecordedSettings, speed)>(
        "camera.speed", config::Effect::restart, "", {0.1, 100}, "",
        "playback speed relative to real time, for the driver recorded"),
});
// clang-format on

inline constexpr config::CameraDriver kRecordedCamera{
    .word = "recorded",
    .help = "a recording, of a Kinect v1 in libfreenect's format or of any camera in that of hapticd",
    .parameters = kRecordedRows,
    .stands_in = true,
    .rate_hz =
        [](const config::CameraSettings& camera) {
          return config::kUsualFrames_hz * camera.of<RecordedSettings>().speed;
        },
    .check =
        [](const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
          if (settings.camera.driver != "recorded" ||
              !settings.camera.of<RecordedSettings>().recording.empty())
            return;
          config::addConflict(conflicts, {"camera.recording", "camera.driver"},
                              "is empty, and the camera.driver recorded needs it",
                              "set camera.recording to the folder that holds INDEX.txt or camera.yaml");
        },
    .source =
        [](const config::CameraSettings& camera) {
          return "the recording " + camera.of<RecordedSettings>().recording;
        }};

std::unique_ptr<Camera> makeRecordedCamera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers
