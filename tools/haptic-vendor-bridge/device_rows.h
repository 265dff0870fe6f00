// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "tools/haptic-vendor-bridge/base/vendor_device.h"

namespace hapticd::tools {

/// The options by which a driver finds its device; each reads what concerns it.
struct VendorOptions {
  std::string library;  ///< path of the vendor's library; empty: where the vendor installs it
  std::string device;   ///< name or serial number; empty: the first one
  std::string address;  ///< of a vendor's service, ADDRESS:PORT; empty: the usual one
};

/// A kind of device that the program can drive.
struct DeviceRow {
  std::string_view word;  ///< of the option --device-kind
  std::string_view help;
  std::unique_ptr<VendorDriver> (*make)(const VendorOptions& options);
};

std::span<const DeviceRow> deviceRows();

}  // namespace hapticd::tools
