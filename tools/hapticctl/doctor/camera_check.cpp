// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "config/base/counted.h"
#include "config/settings/driver_rows.h"
#include "tools/hapticctl/doctor/camera_list.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr int kBytesPerPixel = 2;
/// What bulk transfers reach of the nominal rate: about 36 of 60 MB/s on USB 2, 380 of 625 MB/s on USB 3.
constexpr double kUsableShare = 0.6;
constexpr double kBitsPerByte = 8;

Finding bandwidthFinding(const Examination& box, const ConnectedCamera& camera) {
  const std::string name = "depth camera bandwidth";
  const config::CameraSettings& settings = box.configuration.settings.camera;
  const rt::DepthModelParameters frame = settings.effectiveDepthModel();
  const double rate_hz = config::driverOf(settings).rate_hz(settings);
  const double needed_mb_s = 1e-6 * kBytesPerPixel * frame.width_px * frame.height_px * rate_hz;
  const std::string needs = fmt::format("{} x {} at {} Hz takes {:.1f} MB/s", frame.width_px, frame.height_px,
                                        rate_hz, needed_mb_s);
  const auto devices = usbDevices(box.machine).value_or(std::vector<UsbDevice>{});
  const auto device = std::ranges::find(devices, camera.usb, &UsbDevice::name);
  if (camera.usb.empty() || device == devices.end()) return good(name, needs);
  double speed_mbit_s = 0;
  const std::string& speed = device->speed_mbit_s;
  std::from_chars(speed.data(), speed.data() + speed.size(), speed_mbit_s);
  const std::string fact =
      fmt::format("{} of a link with {} Mbit/s", needs, speed.empty() ? "an unknown number of" : speed);
  if (speed_mbit_s <= 0 || needed_mb_s <= kUsableShare * speed_mbit_s / kBitsPerByte) return good(name, fact);
  return failure(name, fact + ": more than it carries",
                 "plug the camera into a USB 3 port with a USB 3 cable, or set camera.width_px, "
                 "camera.height_px and camera.rate_hz to a smaller mode");
}

Findings findingsOfUsed(const Examination& box, const ConnectedCamera& camera) {
  Findings findings{
      good("depth camera", fmt::format("{} at {}{}{}", camera.name, camera.place,
                                       camera.format.empty() ? "" : ", " + camera.format,
                                       camera.serial.empty() ? "" : ", serial number " + camera.serial))};
  findings.push_back(bandwidthFinding(box, camera));
  const Findings wrong = accessFindings(box, "depth camera access", camera.name, camera.place.substr(1));
  findings.insert(findings.end(), wrong.begin(), wrong.end());
  if (wrong.empty()) findings.push_back(good("depth camera access", "for the group hapticd only"));
  return findings;
}

Finding moduleFinding(const Examination& box) {
  if (box.machine.exists("sys/module/uvcvideo")) return good("uvcvideo", "loaded");
  return warning("uvcvideo", "the kernel's driver of USB cameras is not loaded", "modprobe uvcvideo");
}

}  // namespace

Findings checkCameras(const Examination& box) {
  const config::CameraSettings& settings = box.configuration.settings.camera;
  const DeviceInUse& in_use = box.daemon.camera;
  const CameraList list = listCameras(box.machine, settings, box.depth_probe, {in_use.node, in_use.format});
  Findings findings = findingsOfInUse("depth camera", in_use);
  for (const ConnectedCamera& camera : list.cameras) {
    if (!camera.is_known || camera.suitability != Suitability::unusable) continue;
    findings.push_back(
        warning("depth camera",
                fmt::format("{} at {} cannot be used: {}", camera.name, camera.place, camera.note), ""));
  }
  if (settings.driver != "v4l2") {
    if (findings.empty())
      findings.push_back(
          good("depth camera", fmt::format("no V4L2 camera in use: camera.driver is {}", settings.driver)));
    return findings;
  }
  findings.push_back(moduleFinding(box));
  const auto used = std::ranges::find(list.cameras, Suitability::used, &ConnectedCamera::suitability);
  if (used == list.cameras.end()) {
    if (in_use.state.empty())
      findings.push_back(
          warning("depth camera", list.problem, "hapticctl camera list shows what is connected"));
    return findings;
  }
  for (Finding& finding : findingsOfUsed(box, *used)) findings.push_back(std::move(finding));
  return findings;
}

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
      fmt::format("{} on bus {}", base::counted(neighbours, "other device(s)"), camera.bus);
  if (neighbours < kManyNeighbours) return good("kinect bus", fact);
  return warning("kinect bus", fact + ": depth packets may be lost",
                 "plug the Kinect into a port of another controller; lsusb -t shows them");
}

Finding driverFinding(const Machine& machine, const UsbDevice& camera) {
  const std::string driver = driverOf(machine, camera);
  if (driver.empty()) return good("kinect driver", "no kernel driver uses it");
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
  const std::string& driver = box.configuration.settings.camera.driver;
  if (driver == "freenect") return {absenceFinding(*devices)};
  return {good("kinect", fmt::format("there is none on USB, and camera.driver is {}", driver))};
}

}  // namespace hapticd::tools
