// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "tools/haptic-bridge/force_dimension/dhd.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

/// What a device has, which decides how it is read and driven.
struct DhdCapabilities {
  bool wrist = false;
  bool active_wrist = false;
  bool gripper = false;
  bool active_gripper = false;
};

/// Limits of a model, careful ones where nobody has published any. `type`: as the library numbers them.
DeviceLimits limitsOfDhdType(int type, const DhdCapabilities& capabilities);

/// Drives the devices of Force Dimension (delta, omega, sigma, lambda) by the vendor's libdrd.so, which is
/// loaded when it is first used. The watchdog in the device drops the force when this program dies.
class ForceDimensionDriver final : public DeviceDriver {
 public:
  /// `library`: path; empty: where the vendor installs it. `serial`: of the device; empty: the first one.
  ForceDimensionDriver(std::string library, std::string serial)
      : library_(std::move(library)), serial_(std::move(serial)) {}

  base::Result<void> drive(DeviceSession& session) override;

 private:
  base::Result<char> open() const;

  std::string library_;
  std::string serial_;
  std::optional<Dhd> dhd_;
};

}  // namespace hapticd::tools
