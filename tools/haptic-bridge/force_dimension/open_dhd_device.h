// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "tools/haptic-bridge/force_dimension/dhd.h"
#include "tools/haptic-bridge/force_dimension/force_dimension_driver.h"
#include "tools/lib/device/device_session.h"

namespace hapticd::tools {

/// A device that is open; closed, without force and with its brakes on, with the object. Thread: one.
class OpenDhdDevice {
 public:
  OpenDhdDevice(const Dhd& dhd, char id, DeviceSession& session);
  ~OpenDhdDevice();
  OpenDhdDevice(const OpenDhdDevice&) = delete;
  OpenDhdDevice& operator=(const OpenDhdDevice&) = delete;

  /// Waits until the device knows its position, and tells the person what it needs for that. Returns false if
  /// the session ended before.  Errors: the device is lost.
  base::Result<bool> awaitInitialised();
  /// Sets the watchdog, and turns the forces on, at zero.  Errors: one of that fails.
  base::Result<void> prepare();
  /// Reads and exerts until the session ends.  Errors: the device is lost.
  base::Result<void> run();

 private:
  base::Result<DhdStatusArray> status() const;
  std::string whatItNeeds(const DhdStatusArray& status) const;
  base::Result<void> enableForce();
  base::Result<bool> measure();
  base::Result<void> publish();
  base::Result<void> exert(const DeviceCommand& command);
  base::Result<void> lookAfter(std::int64_t now_ns);
  base::Result<void> lookAtForce(const DhdStatusArray& status, std::int64_t now_ns);
  void lookAtRate(std::int64_t now_ns);
  base::Error lost(const std::string& what) const;

  const Dhd& dhd_;
  char id_;
  DeviceSession& session_;
  DhdCapabilities has_;
  DeviceAbout about_;
  DeviceReading reading_;
  std::int64_t measured_ns_ = 0;
  std::int64_t looked_ns_ = 0;
  std::int64_t counted_since_ns_ = 0;
  std::uint64_t readings_ = 0;  // since then
  bool force_off_ = false;
  std::int64_t force_off_ns_ = 0;  // since when
  Complaint needs_;
  Complaint force_complaint_;
  Complaint rate_complaint_;
  Complaint value_complaint_;
};

}  // namespace hapticd::tools
