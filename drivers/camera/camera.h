// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/error.h"
#include "rt/depth_frame.h"
#include "rt/words.h"

namespace hapticd::drivers {

enum class CameraState {
  absent,     ///< not found yet; the driver keeps looking
  streaming,  ///< frames arrive
  lost,       ///< was there; the driver keeps trying to get it back
};
constexpr auto wordsOf(CameraState) {
  return rt::words<CameraState>("absent", "streaming", "lost");
}

struct CameraStatus {
  CameraState state = CameraState::absent;
  std::string detail;                ///< for people: why it is absent or lost, and what to do
  std::string identity;              ///< driver and serial number or folder
  std::uint64_t frames = 0;          ///< delivered since the start
  std::uint64_t damaged_frames = 0;  ///< not delivered because their data could not be trusted
  std::string advice = {};           ///< for people: what is doubtful about a camera that works; may be empty
};

/// Where a camera driver puts its frames: fill back(), then publish().
/// Thread: the driver's own thread only.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// The frame to fill; its address changes with each publish().
  virtual rt::DepthFrame& back() = 0;
  /// Hands the frame on and wakes the scene thread.
  virtual void publish() = 0;
};

/// A source of raw depth frames with a thread of its own. Absence or loss of the device is a state that the
/// driver recovers from by itself, never an error of the process.
class Camera {
 public:
  virtual ~Camera() = default;
  /// Starts the driver's thread. `sink` outlives stop().
  /// Errors: permanent ones only (a folder that is no recording, a thread that cannot be started).
  virtual config::Result<void> start(FrameSink& sink) = 0;
  /// Ends the thread; no frame is published after it returns. Harmless when not started.
  virtual void stop() = 0;
  /// Thread: any.
  virtual CameraStatus status() const = 0;
};

}  // namespace hapticd::drivers
