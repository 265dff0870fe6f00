// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/base/error.h"
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
  std::string node;      ///< "/dev/video2"
  std::string serial;    ///< of the depth module
  std::string firmware;  ///< "5.15.1.0"
  std::string format;    ///< "Z16"
  int width_px = 0;      ///< of the frames that it sends
  int height_px = 0;     ///< of the frames that it sends
  double rate_hz = 0;
  std::optional<double> temperature_c = {};  ///< of its processor, in degrees Celsius
};

/// CameraStatus::detail until the first attempt to open the camera has ended.
inline constexpr const char* kLookingForCamera = "looking for the camera";

/// State of a camera as shown to people and to clients of the control API.
struct CameraStatus {
  CameraState state = CameraState::absent;
  std::string detail;                ///< for people: why it is absent or lost, and what to do
  std::string identity;              ///< driver name, and serial number or folder
  std::uint64_t frames = 0;          ///< delivered since the start
  std::uint64_t damaged_frames = 0;  ///< discarded because their data was corrupt
  std::uint64_t lost_frames = 0;     ///< missing in the numbering of those that arrived
  std::string advice = {};           ///< for people: a likely problem of a working camera; may be empty
  CameraDetails details = {};
};

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
  /// Starts the driver's thread. `sink` must outlive stop().
  /// Errors: permanent ones only (a folder that is not a recording, a thread that cannot be started).
  virtual base::Result<void> start(FrameSink& sink) = 0;
  /// Ends the thread; no frame is published after it returns. Does nothing if not started.
  virtual void stop() = 0;
  /// Returns the current state.  Thread: any.
  virtual CameraStatus status() const = 0;
};

}  // namespace hapticd::drivers
