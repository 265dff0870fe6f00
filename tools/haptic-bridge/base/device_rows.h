// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

/// The options by which a driver finds its device; each reads what concerns it.
struct VendorOptions {
  std::string library;           ///< path of the vendor's library; empty: where the vendor installs it
  std::string device;            ///< name or serial number; empty: the first one
  std::string address;           ///< of a vendor's service, ADDRESS:PORT; empty: the usual one
  std::string calibration = {};  ///< file of the motors' calibration; empty: where it is kept
};

/// A kind of device that the program can drive.
struct DeviceRow {
  std::string_view word;  ///< KIND on the command line
  std::string_view help;
  std::unique_ptr<DeviceDriver> (*make)(const VendorOptions& options);
};

std::span<const DeviceRow> deviceRows();

/// What a device of Force Dimension has, which decides how it is read and driven.
struct DhdCapabilities {
  bool wrist = false;
  bool active_wrist = false;
  bool gripper = false;
  bool active_gripper = false;
};
/// Limits of a model, careful ones where nobody has published any. `type`: as the vendor's library numbers
/// them.
DeviceLimits limitsOfDhdType(int type, const DhdCapabilities& capabilities);
/// Limits of a model of 3D Systems, those of the weakest one where it is unknown. `nominal_max_force_n`: what
/// the library says, which is never exceeded; not above zero: it says nothing. `output_degrees`: of freedom,
/// driven ones.
DeviceLimits limitsOfHdModel(std::string_view model, double nominal_max_force_n, int output_degrees);

std::unique_ptr<DeviceDriver> makeForceDimensionDriver(const VendorOptions& options);
std::unique_ptr<DeviceDriver> makeOpenHapticsDriver(const VendorOptions& options);
namespace inverse3 {
std::unique_ptr<DeviceDriver> makeInverse3Driver(const VendorOptions& options);
}
namespace phantom_omni {
std::unique_ptr<DeviceDriver> makePhantomOmniDriver(const VendorOptions& options);
}

}  // namespace hapticd::tools
