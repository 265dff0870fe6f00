// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>

#include "config/base/error.h"
#include "rt/base/fields.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Connection state of a camera.
enum class CameraState {
  absent,     ///< not found yet; the driver keeps searching
  streaming,  ///< frames arrive
  lost,       ///< was connected; the driver keeps trying to reconnect
};
constexpr auto wordsOf(CameraState) {
  return rt::words<CameraState>("absent", "streaming", "lost");
}

/// What a camera that the kernel drives reports of itself; empty or 0 where it does not.
struct CameraDetails {
  std::string node;
  std::string serial;
  std::string firmware;
  std::string format;
  int width_px = 0;
  int height_px = 0;
  double rate_hz = 0;
  std::optional<double> temperature_c = {};
};
template <std::same_as<CameraDetails> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(node, "Its video device, such as /dev/video2"),
      HAPTICD_FIELD(serial, "Serial number; empty: not reported"),
      HAPTICD_FIELD(firmware, "Version of its firmware; empty: not reported"),
      HAPTICD_FIELD(format, "Pixel format, such as Z16"),
      HAPTICD_FIELD(width_px, "Columns of the frames that it sends"),
      HAPTICD_FIELD(height_px, "Rows of the frames that it sends"),
      HAPTICD_FIELD(rate_hz, "Nominal frame rate"),
      HAPTICD_FIELD(temperature_c,
                    "Temperature of the processor of the camera in degrees Celsius; null: not reported")
          .gauge("camera_temperature_celsius")};
}

/// CameraStatus::detail until the first attempt to open the camera has ended.
inline constexpr const char* kLookingForCamera = "looking for the camera";

/// State of a camera as shown to people and to clients of the control API.
struct CameraStatus {
  CameraState state = CameraState::absent;
  std::string detail;
  std::string identity;
  std::uint64_t frames = 0;
  std::uint64_t damaged_frames = 0;
  std::uint64_t lost_frames = 0;
  std::string advice = {};
  CameraDetails details = {};
};
template <std::same_as<CameraStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(state, "State of the depth camera: whether frames arrive").states("camera_state"),
      HAPTICD_FIELD(detail, "Why it is absent or lost, and what to do; may be empty"),
      HAPTICD_FIELD(identity, "Driver and serial number or folder"),
      HAPTICD_FIELD(frames, "Frames that the camera has delivered").counter("camera_frames"),
      HAPTICD_FIELD(damaged_frames, "Frames discarded because their data was damaged")
          .counter("camera_damaged_frames"),
      HAPTICD_FIELD(lost_frames,
                    "Frames that never arrived, as the numbers of those before and after them tell; 0 where "
                    "a camera does not number them")
          .counter("camera_lost_frames"),
      HAPTICD_FIELD(advice, "A likely problem of a camera that works, and what to do; may be empty"),
      HAPTICD_FIELD(
          details,
          "What it reports of itself; null with other drivers than v4l2, and until the camera is found")
          .shownAs([](const auto& camera) {
            return camera.details.node.empty() ? std::nullopt : std::optional(camera.details);
          })};
}

/// Destination of a camera driver's frames: fill back(), then call publish().
/// Thread: the driver's own thread only.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Returns the frame to fill; its address changes with each publish().
  virtual rt::DepthFrame& back() = 0;
  /// Passes the frame on and wakes the scene thread.
  virtual void publish() = 0;
};

/// A source of raw depth frames with a thread of its own. Absence or loss of the device is a state from which
/// the driver recovers by itself, never an error of the process.
class Camera {
 public:
  virtual ~Camera() = default;
  /// Refuses settings, and files that they name, for the reasons for which start() does; starts nothing.
  virtual base::Result<void> check() const { return {}; }
  /// Starts the driver's thread. `sink` must outlive stop().
  /// Errors: permanent ones only (a folder that is not a recording, a thread that cannot be started).
  virtual base::Result<void> start(FrameSink& sink) = 0;
  /// Ends the thread; no frame is published after it returns. Does nothing if not started.
  virtual void stop() = 0;
  /// Returns the current state.  Thread: any.
  virtual CameraStatus status() const = 0;
};

}  // namespace hapticd::drivers
