// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "tools/haptic-bridge/open_haptics/hd.h"
#include "tools/lib/device/device_session.h"

namespace hapticd::tools {

/// What the thread of the library's scheduler has found, for the driver's thread.
struct ServoReport {
  bool calibrated = false;
  bool force_on = false;              ///< the device accepts forces
  unsigned int calibration = 0;       ///< HdCalibration
  unsigned int lost_by = kHdSuccess;  ///< the error by which the device is lost; kHdSuccess: it is not
  bool jumped = false;
  bool not_finite = false;
  std::uint64_t warm = 0;               ///< how often the motors were warm
  std::array<std::uint64_t, 4> cuts{};  ///< how often the device cut the force, by HdError - kHdExceededForce
  std::uint64_t frames = 0;
};

/// The part of the driver that runs in the thread of OpenHaptics' scheduler, 1000 times a second: it carries
/// readings and forces. Calibration runs here as well, because it has no effect elsewhere with some versions.
/// Thread: tick() the scheduler's, everything else the driver's.
class ServoLoop {
 public:
  /// Before the callback is scheduled.
  void begin(const Hd& hd, HdHandle device, unsigned int calibration_style, bool drives_torque,
             DeviceExchange& exchange);
  /// For the scheduler; `loop`: the ServoLoop.
  static unsigned int callback(void* loop) { return static_cast<ServoLoop*>(loop)->tick(); }

  /// The device may be turned on: the exchange has its limits.
  void allowForce() { force_allowed_ = true; }
  /// The person has put the device where its calibration begins.
  void calibrate() { calibrate_ = true; }
  /// Zero from the next frame on. `isAtRest`: such a frame has been sent, or none is sent any more.
  void rest() { resting_ = true; }
  bool isAtRest() const { return rested_; }
  ServoReport report() const;

 private:
  unsigned int tick();
  DeviceReading read();
  void write(const DeviceCommand& command);
  DeviceCommand commandAt(std::int64_t now_ns, bool may_push);
  void take(unsigned int error, std::int64_t now_ns);
  void steerForceOutput(bool calibrated);
  void steerCalibration(unsigned int calibration, std::int64_t now_ns);

  Hd hd_{};
  HdHandle device_ = kNoHdHandle;
  unsigned int style_ = 0;
  bool drives_torque_ = false;
  DeviceExchange* exchange_ = nullptr;

  // the scheduler's thread
  int clean_frames_ = 0;  // in a row
  int frames_since_start_ = 0;
  bool enabled_ = false;
  bool cut_ = false;                 // by the device; until the commanded force is small
  std::int64_t small_since_ns_ = 0;  // when a force that is not small was commanded last
  std::int64_t warm_until_ns_ = 0;
  std::int64_t updated_ns_ = 0;       // the calibration
  std::int64_t end_of_frame_ns_ = 0;  // how long the last one took

  std::atomic<bool> force_allowed_{false};
  std::atomic<bool> calibrate_{false};
  std::atomic<bool> resting_{false};
  std::atomic<bool> rested_{false};
  std::atomic<bool> calibrated_{false};
  std::atomic<bool> force_on_{false};
  std::atomic<unsigned int> calibration_{0};
  std::atomic<unsigned int> lost_by_{kHdSuccess};
  std::atomic<bool> jumped_{false};
  std::atomic<bool> not_finite_{false};
  std::atomic<std::uint64_t> warm_{0};
  std::array<std::atomic<std::uint64_t>, 4> cuts_{};
  std::atomic<std::uint64_t> frames_{0};
};

}  // namespace hapticd::tools
