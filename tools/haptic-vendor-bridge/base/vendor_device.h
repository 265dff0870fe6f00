// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "tools/haptic-vendor-bridge/base/device_session.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

/// The options by which a driver finds its device; each reads what concerns it.
struct VendorOptions {
  std::string library;           ///< path of the vendor's library; empty: where the vendor installs it
  std::string device;            ///< name or serial number; empty: the first one
  std::string address;           ///< of a vendor's service, ADDRESS:PORT; empty: the usual one
  std::string calibration = {};  ///< file of the motors' calibration; empty: where it is kept
};

/// Drives devices of one kind by the library or service of its vendor. Thread: one, but for a library's own.
class VendorDriver {
 public:
  virtual ~VendorDriver() = default;
  /// Opens a device, leads the person through what it needs (calibration), says that it is opened, and drives
  /// it until the session ends or the device is lost. However it returns, the device exerts nothing any more
  /// and has its brakes on. No force before the device is initialised and calibrated.
  /// A velocity of the vendor is not passed on: by how much it was filtered, and so how late it is, no vendor
  /// publishes, and damping with a late velocity is unstable (rt/safety/stiffness_limit.h).
  /// Returns why the device could not be used any longer; nothing: the session ended.
  virtual base::Result<void> drive(DeviceSession& session) = 0;
};

/// A device behind a VendorDriver, which has a thread of its own and is opened again after a pause when it is
/// lost or not there yet.
class VendorDevice final : public Device {
 public:
  static constexpr std::chrono::milliseconds kRetry{1000};

  /// `name`: of the program, for messages.
  VendorDevice(std::unique_ptr<VendorDriver> driver, std::string name)
      : driver_(std::move(driver)), name_(std::move(name)) {}
  /// Ends the thread, which leaves the device without force.
  ~VendorDevice() override;

  /// Errors: no thread can be started.
  base::Result<void> start();
  DeviceReading read() override;
  void exert(const DeviceCommand& command) override;
  DeviceLimits limits() const override { return exchange_.limits(); }
  /// What was opened last.  Thread: any.
  DeviceAbout about() const;

 private:
  void run();

  std::unique_ptr<VendorDriver> driver_;
  std::string name_;
  DeviceExchange exchange_;
  drivers::StopSignal stop_;
  mutable std::mutex about_mutex_;
  DeviceAbout about_;
  std::thread thread_;
};

}  // namespace hapticd::tools
