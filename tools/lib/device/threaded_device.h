// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "tools/lib/bridge/device.h"
#include "tools/lib/device/device_session.h"

namespace hapticd::tools {

/// Drives devices of one kind. Thread: one, but for those of a library.
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  /// Opens a device, leads the person through what it needs (calibration), says that it is opened, and drives
  /// it until the session ends or the device is lost. However it returns, the device exerts nothing any more
  /// and has its brakes on. No force before the device is initialised and calibrated.
  /// A velocity of the vendor is not passed on: by how much it was filtered, and so how late it is, no vendor
  /// publishes, and damping with a late velocity is unstable (rt/safety/stiffness_limit.h).
  /// Returns why the device could not be used any longer; nothing: the session ended.
  virtual base::Result<void> drive(DeviceSession& session) = 0;
};

/// A device behind a DeviceDriver, which has a thread of its own and is opened again after a pause when it is
/// lost or not there yet. Another thread names a call of the driver (OutsideCall) that hangs.
class ThreadedDevice final : public Device {
 public:
  static constexpr std::chrono::milliseconds kRetry{1000};

  /// `name`: of the program, for messages.
  ThreadedDevice(std::unique_ptr<DeviceDriver> driver, std::string name)
      : driver_(std::move(driver)), name_(std::move(name)) {}
  /// Ends the thread, which leaves the device without force, and waits for a call that hangs.
  ~ThreadedDevice() override;

  /// Errors: no thread can be started.
  base::Result<void> start();
  DeviceReading read() override;
  void exert(const DeviceCommand& command) override;
  DeviceLimits limits() const override { return exchange_.limits(); }
  /// What was opened last.  Thread: any.
  DeviceAbout about() const;

 private:
  void run();
  void watch();

  std::unique_ptr<DeviceDriver> driver_;
  std::string name_;
  DeviceExchange exchange_;
  drivers::StopSignal stop_;
  mutable std::mutex about_mutex_;
  DeviceAbout about_;
  std::thread thread_;
  drivers::StopSignal watch_ends_;
  std::thread watch_thread_;
};

}  // namespace hapticd::tools
