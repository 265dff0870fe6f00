// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

struct CheckOptions {
  std::string program;    ///< whose command this is
  std::string version;    ///< of the program
  std::string kind = {};  ///< of the device
  std::string log = {};   ///< the file to write; empty: haptic-check-KIND.json in this folder
  std::string read = {};  ///< a log to print instead of checking a device; empty: check one
};

/// Starts a device, leads the person at the terminal through the check of a device and writes its log.
/// Returns the exit status.
int checkDevice(const CheckOptions& options, ThreadedDevice& device);

/// Prints a log that somebody sent. Returns the exit status.
int printLog(const CheckOptions& options);

}  // namespace hapticd::tools
