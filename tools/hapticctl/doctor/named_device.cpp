// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/named_device.h"

#include <algorithm>
#include <filesystem>
#include <variant>

#include "config/settings/driver_rows.h"
#include "drivers/handle/hid/hid_settings.h"
#include "tools/hapticctl/doctor/usb_device.h"

namespace hapticd::tools {

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
