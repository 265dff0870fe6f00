// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/usb_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace hapticd::tools {

std::string variableOf(const std::string& uevent, const std::string& name) {
  std::istringstream lines(uevent);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + "=")) return line.substr(name.size() + 1);
  }
  return {};
}

std::optional<drivers::HidId> hidIdIn(const std::string& uevent) {
  const std::string id = variableOf(uevent, "HID_ID");
  constexpr std::size_t kLength = 22;  // bus, vendor and product: 4, 8 and 8 digits
  if (id.size() != kLength) return std::nullopt;
  const auto parsed = drivers::hidIdFrom(id.substr(9, 4) + ":" + id.substr(18, 4));
  return parsed ? std::optional(*parsed) : std::nullopt;
}

namespace {

const std::string kDevices = "sys/bus/usb/devices/";

UsbDevice deviceNamed(const Machine& machine, const std::string& name) {
  const std::string folder = kDevices + name + "/";
  const auto text = [&](const char* file) { return machine.read(folder + file).value_or(""); };
  const auto number = [&](const char* file) { return machine.readNumber(folder + file).value_or(0); };
  return {name,
          text("idVendor"),
          text("idProduct"),
          text("bDeviceClass"),
          number("busnum"),
          number("devnum"),
          text("speed"),
          text("power/control")};
}

}  // namespace

bool UsbDevice::isKinectCamera() const {
  return vendor == kKinectVendor && std::ranges::find(kKinectCameras, product) != kKinectCameras.end();
}

bool UsbDevice::isKinectPart() const {
  return isKinectCamera() || (vendor == kKinectVendor &&
                              std::ranges::find(kKinectOtherParts, product) != kKinectOtherParts.end());
}

std::string UsbDevice::node() const {
  return fmt::format("dev/bus/usb/{:03}/{:03}", bus, number);
}

std::string UsbDevice::text() const {
  return fmt::format("{}:{} at {}", vendor, product, name);
}

Reading<std::vector<UsbDevice>> usbDevices(const Machine& machine) {
  const Reading<Names> names = machine.list(kDevices);
  if (!names && names.error().absent()) return std::vector<UsbDevice>{};
  if (!names) return std::unexpected(names.error());
  std::vector<UsbDevice> devices;
  for (const std::string& name : *names) {
    // names with a colon are interfaces of a device
    if (name.find(':') == std::string::npos) devices.push_back(deviceNamed(machine, name));
  }
  return devices;
}

std::string driverOf(const Machine& machine, const UsbDevice& device) {
  return machine.linkedName(kDevices + device.name + "/" + device.name + ":1.0/driver");
}

}  // namespace hapticd::tools
