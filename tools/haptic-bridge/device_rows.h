// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "tools/haptic-bridge/base/vendor_options.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

/// A kind of device that the program can drive.
struct DeviceRow {
  std::string_view word;  ///< KIND on the command line
  std::string_view help;
  std::unique_ptr<DeviceDriver> (*make)(const VendorOptions& options);
};

std::span<const DeviceRow> deviceRows();

}  // namespace hapticd::tools
