// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/findings.h"
#include "tools/hapticctl/doctor/usb_device.h"

namespace hapticd::tools {
namespace {

constexpr std::ptrdiff_t kManyNeighbours = 4;

Finding absenceFinding(const std::vector<UsbDevice>& devices) {
  if (std::ranges::any_of(devices, &UsbDevice::isKinectPart)) {
    return warning("kinect", "its motor or microphone is on USB, but not its camera",
                   "plug in the Kinect's own power supply: USB alone does not power the camera");
  }
  return warning("kinect", "there is none on USB", "plug it into a USB port and into its own power supply");
}

Finding speedFinding(const UsbDevice& camera) {
  const std::string fact = fmt::format("{}, {} Mbit/s", camera.text(), camera.speed_mbit_s);
  if (camera.speed_mbit_s == "480") return good("kinect", fact);
  return failure("kinect", fact + ": too slow for depth, which takes 480",
                 "plug it into another port, without a hub or an extension");
}

Findings rightFindings(const Examination& box, const UsbDevice& camera) {
  Findings findings = accessFindings(box, "kinect access", camera.text(), camera.node());
  if (findings.empty()) findings.push_back(good("kinect access", "for the group hapticd only"));
  return findings;
}

Finding suspendFinding(const UsbDevice& camera) {
  if (camera.power_control == "on") return good("kinect autosuspend", "off");
  return warning(
      "kinect autosuspend",
      fmt::format("power/control of {} is {}: a suspended camera responds too late", camera.text(),
                  camera.power_control.empty() ? "not readable" : camera.power_control),
      fmt::format("echo on > /sys/bus/usb/devices/{}/power/control; hapticd's udev rules do it at each "
                  "plug",
                  camera.name));
}

Finding busFinding(const std::vector<UsbDevice>& devices, const UsbDevice& camera) {
  const auto neighbours = std::ranges::count_if(devices, [&](const UsbDevice& device) {
    return device.bus == camera.bus && !device.isHub() && !device.isKinectPart();
  });
  const std::string fact =
      fmt::format("{} on bus {}", counted(static_cast<std::size_t>(neighbours), "other device"), camera.bus);
  if (neighbours < kManyNeighbours) return good("kinect bus", fact);
  return warning("kinect bus", fact + ": depth packets may be lost",
                 "plug the Kinect into a port of another controller; lsusb -t shows them");
}

Finding driverFinding(const Machine& machine, const UsbDevice& camera) {
  const std::string driver = driverOf(machine, camera);
  if (driver.empty()) return good("kinect driver", "none of the kernel's");
  if (driver == "usbfs") return good("kinect driver", "usbfs: a program uses it now");
  return good("kinect driver", driver + ": harmless, hapticd takes the camera over");
}

}  // namespace

Findings checkKinect(const Examination& box) {
  const Reading<std::vector<UsbDevice>> devices = usbDevices(box.machine);
  if (!devices) return {unreadable("kinect", "sys/bus/usb/devices", devices.error())};
  Findings findings;
  for (const UsbDevice& camera : *devices) {
    if (!camera.isKinectCamera()) continue;
    findings.push_back(speedFinding(camera));
    for (Finding& finding : rightFindings(box, camera)) findings.push_back(std::move(finding));
    findings.push_back(suspendFinding(camera));
    findings.push_back(busFinding(*devices, camera));
    findings.push_back(driverFinding(box.machine, camera));
  }
  if (!findings.empty()) return findings;
  const config::CameraDriver driver = box.configuration.settings.camera.driver;
  if (driver == config::CameraDriver::freenect) return {absenceFinding(*devices)};
  return {good("kinect", fmt::format("there is none on USB, and camera.driver is {}", rt::wordOf(driver)))};
}

}  // namespace hapticd::tools
