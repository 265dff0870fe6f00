// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>
#include <variant>

#include "config/settings/driver_rows.h"
#include "drivers/handle/hid/hid_settings.h"

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
  const Reading<Names> names = machine.list(kDevices.substr(0, kDevices.size() - 1));
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

// the second column is "address:port" in hexadecimal, the fourth the state
bool isPortInUse(const std::string& table, int port, std::string_view state) {
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);  // the titles of the columns
  while (std::getline(lines, line)) {
    std::istringstream columns(line);
    std::string number, local, remote, state_of_it;
    columns >> number >> local >> remote >> state_of_it;
    const std::size_t colon = local.find(':');
    if (colon == std::string::npos || (!state.empty() && state_of_it != state)) continue;
    int used = 0;
    std::from_chars(local.data() + colon + 1, local.data() + local.size(), used, 16);
    if (used == port) return true;
  }
  return false;
}

bool isChipOfLeds(const Examination& box, const std::string& chip) {
  const config::LedSettings& leds = box.configuration.settings.leds;
  if (leds.driver != config::LedDriver::gpiod) return false;
  const std::string path = "/dev/" + chip;
  if (leds.chip.starts_with('/')) return box.machine.resolved(leds.chip) == path;
  if (leds.chip == chip || box.machine.resolved("/dev/" + leds.chip) == path) return true;
  if (!box.gpio_label) return false;
  const auto label = box.gpio_label(path);
  return label && *label == leds.chip;
}

bool isHidHandle(const Examination& box, const std::string& node) {
  const config::HandleSettings& handle = box.configuration.settings.handle;
  const std::string uevent = box.machine.read("sys/class/hidraw/" + node + "/device/uevent").value_or("");
  const auto id = hidIdIn(uevent);
  const auto is_it = [&id](const config::Need& need) {
    const auto* const hid = std::get_if<config::HidNeed>(&need);
    if (hid == nullptr || !id) return false;
    const auto configured = drivers::hidIdFrom(hid->device);
    return configured && *id == *configured;
  };
  if (std::ranges::none_of(config::driverOf(handle).needs(handle), is_it)) return false;
  return handle.serial.empty() || variableOf(uevent, "HID_UNIQ") == handle.serial;
}

bool isNamedDevice(const Examination& box, const std::string& device) {
  if (!box.configuration.problem.empty()) return false;
  const std::string name = std::filesystem::path(device).filename().string();
  if (name.starts_with("gpiochip")) return isChipOfLeds(box, name);
  return name.starts_with("hidraw") && isHidHandle(box, name);
}

}  // namespace hapticd::tools
