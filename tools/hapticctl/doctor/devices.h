// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/handle/hid/hid_settings.h"
#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// The value of a variable in a uevent file; empty if it is absent.
std::string variableOf(const std::string& uevent, const std::string& name);

/// Vendor and product in the uevent of a HID device, "HID_ID=0003:0000046D:0000C626"; nothing if absent.
std::optional<drivers::HidId> hidIdIn(const std::string& uevent);

inline constexpr const char* kKinectVendor = "045e";
inline constexpr std::array kKinectCameras{"02ae", "02bf"};
/// The product ids of a Kinect's motor and microphones.
inline constexpr std::array kKinectOtherParts{"02b0", "02c2", "02ad", "02be"};

/// A USB device as sysfs shows it.
struct UsbDevice {
  std::string name;    ///< its place in the tree of hubs, "1-1.2"
  std::string vendor;  ///< four hexadecimal digits
  std::string product;
  std::string device_class;  ///< "09" for hubs
  std::int64_t bus = 0;
  std::int64_t number = 0;    ///< its number on its bus
  std::string speed_mbit_s;   ///< "1.5", "12", "480", "5000"
  std::string power_control;  ///< "on", or "auto" where it may be suspended

  bool isKinectCamera() const;
  bool isKinectPart() const;  ///< camera, motor or microphone
  bool isHub() const { return device_class == "09"; }
  /// The device file, without the leading slash.
  std::string node() const;
  /// "045e:02ae at 1-1.2".
  std::string text() const;
};

/// All USB devices; none on a machine without USB.
Reading<std::vector<UsbDevice>> usbDevices(const Machine& machine);

/// The kernel's driver of the first interface; empty if there is none.
std::string driverOf(const Machine& machine, const UsbDevice& device);

/// Whether a socket of the table, the content of /proc/net/udp or /proc/net/tcp, is bound to a port.
/// `state`: only sockets in this state as the kernel numbers it, two hexadecimal digits; empty: any.
bool isPortInUse(const std::string& table, int port, std::string_view state = "");

/// Whether leds.chip of the configuration names a GPIO chip: by path, by name ("gpiochip0") or by label, as
/// the driver takes it. `chip`: the name of its device file.
bool isChipOfLeds(const Examination& box, const std::string& chip);

/// Whether the configuration names a HID device as the handle, by vendor and product, and by serial number if
/// one is given. `node`: the name of its device file, "hidraw0".
bool isHidHandle(const Examination& box, const std::string& node);

/// Whether the configuration names a device: a GPIO chip whose lines are LEDs, or a HID device that is the
/// handle. The udev rules ask this, so that hapticd gets no device that it does not use. `device`: its device
/// file,
/// "/dev/gpiochip0".
bool isNamedDevice(const Examination& box, const std::string& device);

}  // namespace hapticd::tools
