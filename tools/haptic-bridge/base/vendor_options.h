// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools {

/// The options by which a driver finds its device; each reads what concerns it.
struct VendorOptions {
  std::string library;           ///< path of the vendor's library; empty: where the vendor installs it
  std::string device;            ///< name or serial number; empty: the first one
  std::string address;           ///< of a vendor's service, ADDRESS:PORT; empty: the usual one
  std::string calibration = {};  ///< file of the motors' calibration; empty: where it is kept
};

}  // namespace hapticd::tools
