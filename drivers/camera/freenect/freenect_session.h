// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/error.h"
#include "drivers/camera/freenect/frame_integrity.h"

struct _freenect_context;
struct _freenect_device;

namespace hapticd::drivers {

/// One opened Kinect and the libfreenect context that it belongs to, from open() to the destructor. A context
/// that has lost its device is not used again.
///
/// libfreenect's control transfers have no time limit: open(), startDepth(), stopDepth() and the destructor
/// hang for as long as a camera does not answer. processEvents() does not. Where a call may hang, libfreenect
/// has only a buffer of this object, never one of the caller's.
/// Thread: all of it in one thread, since libfreenect calls back in it.  RT: not safe.
class FreenectSession {
 public:
  /// What is called with each depth frame, in processEvents(): why the frame is damaged, if it is, and the
  /// camera's ticks. It returns the buffer for the next frame.
  using FrameHandler =
      std::function<std::uint16_t*(const std::optional<std::string>& damage, std::uint32_t device_ticks)>;

  /// Opens the camera with that serial number, or the first one if it is empty.
  /// Errors: no camera, no permission, libusb not usable.
  static config::Result<std::unique_ptr<FreenectSession>> open(const std::string& serial);

  ~FreenectSession();
  FreenectSession(const FreenectSession&) = delete;
  FreenectSession& operator=(const FreenectSession&) = delete;

  /// Empty when libfreenect cannot tell.
  const std::string& serial() const { return serial_; }
  /// The serial numbers of all cameras found; empty when libfreenect cannot tell.
  const std::vector<std::string>& serialsFound() const { return serials_; }

  /// Starts the depth stream; its frames go nowhere until deliverTo().
  config::Result<void> startDepth();
  /// From now on frames (640 x 480 raw disparities) are written to `buffer` and then told to `handler`.
  void deliverTo(std::uint16_t* buffer, FrameHandler handler);
  /// Takes the buffer away from libfreenect again.
  void deliverNowhere();
  /// Waits for events up to `limit` (the player fakenect ignores it and waits for its next frame).
  /// Errors: the camera is gone.
  config::Result<void> processEvents(std::chrono::microseconds limit);

 private:
  FreenectSession() = default;
  static void onDepth(_freenect_device* device, void* depth, std::uint32_t ticks);
  static void onLog(_freenect_context* context, int level, const char* message);
  config::Result<void> initialise();
  config::Result<void> openDevice(const std::string& serial);
  config::Error failure(std::string what, std::string remedy) const;

  _freenect_context* context_ = nullptr;
  _freenect_device* device_ = nullptr;
  bool depth_started_ = false;
  std::string serial_;
  std::vector<std::string> serials_;
  std::string complaint_;  // libfreenect's newest warning or error
  FrameIntegrity integrity_;
  FrameHandler handler_;
  std::unique_ptr<std::uint16_t[]> spare_buffer_;
};

}  // namespace hapticd::drivers
