// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "tools/haptic-bridge/base/vendor_options.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::phantom_omni {

inline constexpr double kMostForce_n = 3.3;

/// The command that exerts `force_n` at these angles. A force that a motor cannot exert is shortened in its
/// own direction.
OmniCommand commandFor(const PerJoint<double>& angles_rad, const PerJoint<double>& n_m_per_count,
                       const rt::Vec3& force_n);

/// Drives the Phantom Omni with FireWire by its packets. It exerts forces once the calibration of this very
/// device is stored, and only if that says that the device lets go without packets.
class PhantomOmniDriver final : public DeviceDriver {
 public:
  /// `serial`: of the device; empty: the first one. `calibration_file`: empty: where it is kept.
  PhantomOmniDriver(std::string serial, std::string calibration_file)
      : serial_(std::move(serial)), calibration_file_(std::move(calibration_file)) {}

  base::Result<void> drive(DeviceSession& session) override;

 private:
  std::optional<PerJoint<double>> gains(DeviceSession& session, const std::string& serial);

  std::string serial_;
  std::string calibration_file_;
  Complaint no_force_;
};

std::unique_ptr<DeviceDriver> makePhantomOmniDriver(const VendorOptions& options);

}  // namespace hapticd::tools::phantom_omni
