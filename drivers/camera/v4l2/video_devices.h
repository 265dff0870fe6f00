// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"

namespace hapticd::drivers {

/// A video node of a USB device, as sysfs shows it.
struct VideoDevice {
  std::string node;          ///< "/dev/video2"
  std::string name;          ///< of the function, "Intel(R) RealSense(TM) Depth Camera 435"
  std::uint16_t vendor = 0;  ///< 0: not a USB device
  std::uint16_t product = 0;
  std::string serial;              ///< of the USB device; may be empty
  std::string usb_interface;       ///< "1-2:1.0"; empty: not a USB device
  std::vector<std::string> links;  ///< names in /dev/v4l/by-id
  int index = 0;                   ///< among the nodes of the same interface, in order of registration
};

/// Returns all video nodes, in the order of their numbers; none on a machine without any. `root`: stands for
/// "/".
std::vector<VideoDevice> videoDevices(const std::filesystem::path& root = "/");

/// Returns the nodes that the settings allow, in order: that of camera.device, those of camera.serial, or all
/// of them.
/// Errors: none; the error names what was found.
base::Result<std::vector<VideoDevice>> candidatesOf(const config::CameraSettings& settings,
                                                    const std::vector<VideoDevice>& devices);

}  // namespace hapticd::drivers
