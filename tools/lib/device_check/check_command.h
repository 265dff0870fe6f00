// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "tools/lib/device/threaded_device.h"
#include "tools/lib/device_check/check_report.h"

namespace hapticd::tools {

struct CheckOptions {
  std::string program;    ///< whose command this is
  std::string version;    ///< of the program
  std::string kind = {};  ///< of the device
  std::string log = {};   ///< the file to write; empty: haptic-check-KIND.json in this folder
  std::string read = {};  ///< a log to print instead of checking a device; empty: check one
  /// What to do about forces along such axes, whole sentences; may be empty. Where it is given, the person
  /// turns the tool for pushes in other orientations, if the device measures them.
  std::function<std::string(ForceAxes)> remedy = {};
};

/// Starts a device, leads the person at the terminal through the check of a device and writes its log.
/// Returns the exit status.
int checkDevice(const CheckOptions& options, ThreadedDevice& device);

/// Prints a log that somebody sent. Returns the exit status.
int printLog(const CheckOptions& options);

}  // namespace hapticd::tools
