// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

inline constexpr const char* kKinectVendor = "045e";
inline constexpr std::array kKinectCameras{"02ae", "02bf"};
/// Motors and microphones: what a Kinect has besides its camera.
inline constexpr std::array kKinectOtherParts{"02b0", "02c2", "02ad", "02be"};

/// A device on USB as sysfs shows it.
struct UsbDevice {
  std::string name;    ///< place in the tree of hubs, "1-1.2"
  std::string vendor;  ///< four hexadecimal digits
  std::string product;
  std::string device_class;  ///< "09" for hubs
  std::int64_t bus = 0;
  std::int64_t number = 0;    ///< on its bus
  std::string speed_mbit_s;   ///< "1.5", "12", "480", "5000"
  std::string power_control;  ///< "on", or "auto" where it may be suspended

  bool isKinectCamera() const;
  bool isKinectPart() const;  ///< camera, motor or microphone
  bool isHub() const { return device_class == "09"; }
  /// The file through which programs use it, without the leading slash.
  std::string node() const;
  /// "045e:02ae at 1-1.2".
  std::string text() const;
};

/// All of them; none where there is no USB.
Reading<std::vector<UsbDevice>> usbDevices(const Machine& machine);

/// The kernel's driver of its first interface; empty if it has none.
std::string driverOf(const Machine& machine, const UsbDevice& device);

}  // namespace hapticd::tools
