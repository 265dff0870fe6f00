// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/driver_rows.h"
#include "drivers/camera/camera_worker.h"

struct _freenect_context;
struct _freenect_device;

namespace hapticd::drivers {

/// Determines from libfreenect's log whether the next depth frame that it delivers is complete. libfreenect
/// delivers a frame with up to five lost packets without notice, leaving older data in the gaps; only its log
/// mentions them: "[Stream 70] Lost n packets" and short packets while the frame arrives, and (at level SPEW)
/// "Got depth frame of size ..., a/b packets arrived" right before the frame's callback. The packet count
/// takes precedence, because a loss may belong to a frame that was abandoned.
/// Thread: the one that calls libfreenect.
class FrameIntegrity {
 public:
  /// Processes one line of libfreenect's log.
  void noteLogLine(std::string_view line);

  /// Called once per delivered frame; returns why it is damaged, or nothing if it is complete.
  std::optional<std::string> takeDamage();

 private:
  std::string loss_;                // newest line about data missing in the frame in progress
  std::string count_;               // packet count of the frame about to be delivered
  bool count_is_complete_ = false;  // a == b
};

/// An opened Kinect with its libfreenect context, from open() to the destructor. A context that has lost its
/// device is not reused.
///
/// libfreenect's control transfers have no timeout: open(), startDepth(), stopDepth() and the destructor hang
/// for as long as a camera does not respond; processEvents() does not. While a call may hang, libfreenect
/// only holds a buffer of this object, never one of the caller.
/// Thread: always the same one, in which libfreenect also calls back.  RT: not safe.
class FreenectSession {
 public:
  /// Called by processEvents() for each depth frame, with the reason if the frame is damaged and the camera's
  /// tick counter. Returns the buffer for the next frame.
  using FrameHandler =
      std::function<std::uint16_t*(const std::optional<std::string>& damage, std::uint32_t device_ticks)>;

  /// Opens the camera with this serial number, or the first one if it is empty.
  /// Errors: no camera, no permission, libusb not usable.
  static base::Result<std::unique_ptr<FreenectSession>> open(const std::string& serial);

  ~FreenectSession();
  FreenectSession(const FreenectSession&) = delete;
  FreenectSession& operator=(const FreenectSession&) = delete;

  /// Returns the camera's serial number; empty if libfreenect does not provide it.
  const std::string& serial() const { return serial_; }
  /// Returns the serial numbers of all cameras found; empty if libfreenect does not provide them.
  const std::vector<std::string>& serialsFound() const { return serials_; }

  /// Starts the depth stream; frames are discarded until deliverTo().
  base::Result<void> startDepth();
  /// Makes frames (640 x 480 raw disparities) go to `buffer`; `handler` is called for each.
  void deliverTo(std::uint16_t* buffer, FrameHandler handler);
  /// Takes the buffer away from libfreenect; frames are discarded again.
  void deliverNowhere();
  /// Waits for events for at most `limit` (the player fakenect ignores it and waits for its next frame).
  /// Errors: the camera is gone.
  base::Result<void> processEvents(std::chrono::microseconds limit);

 private:
  FreenectSession() = default;
  static void onDepth(_freenect_device* device, void* depth, std::uint32_t ticks);
  static void onLog(_freenect_context* context, int level, const char* message);
  base::Result<void> initialise();
  base::Result<void> openDevice(const std::string& serial);
  base::Error failure(std::string what, std::string remedy) const;

  _freenect_context* context_ = nullptr;
  _freenect_device* device_ = nullptr;
  bool depth_started_ = false;
  std::string serial_;
  std::vector<std::string> serials_;
  std::string last_problem_;  // libfreenect's newest warning or error
  FrameIntegrity integrity_;
  FrameHandler handler_;
  std::unique_ptr<std::uint16_t[]> spare_buffer_;
};

/// Driver of a Kinect v1 through libfreenect, depth only: libfreenect writes 11-bit raw disparities straight
/// into the sink's frame. While the camera is absent or lost, the driver searches for it once a second.
///
/// stop() waits at most `stop_limit` for a thread that hangs in libfreenect (see FreenectSession). The thread
/// is then abandoned together with the data it still needs; it no longer accesses the sink and ends when
/// libfreenect returns, if ever. With the player fakenect, stop() waits for the next recorded frame.
class FreenectCamera final : public WorkerCamera {
 public:
  explicit FreenectCamera(const std::string& serial,
                          std::chrono::milliseconds stop_limit = std::chrono::milliseconds(3000));
};

inline constexpr config::CameraDriver kFreenectCamera{.word = "freenect",
                                                      .help = "a Kinect v1 on USB, through libfreenect"};

std::unique_ptr<Camera> makeFreenectCamera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers
