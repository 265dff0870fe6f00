// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/cameras.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "config/base/counted.h"
#include "config/base/value_text.h"
#include "config/settings/driver_rows.h"
#include "drivers/camera/v4l2/capture_stream.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"

namespace hapticd::tools {
namespace {

constexpr const char* kDepthByVendor =
    "it delivers infrared images, and its vendor's software computes the depth";
constexpr const char* kOwnProtocol = "it is not a video device: its vendor's software talks to it";
constexpr const char* kTwoViews =
    "it delivers two colour images, and its vendor's software computes the depth";
constexpr const char* kLibfreenect2 = "it needs libfreenect2, which hapticd does not use";

// Ids of RealSense: librealsense, src/ds/d400/d400-private.h; of Orbbec: OrbbecSDK_v2; of the others: the
// udev rules of their vendors' software.
constexpr std::array<KnownCamera, 26> kCameras{{
    {0x8086, 0x0ad1, "Intel RealSense D400", ""},
    {0x8086, 0x0ad2, "Intel RealSense D410", ""},
    {0x8086, 0x0ad3, "Intel RealSense D415", ""},
    {0x8086, 0x0ad4, "Intel RealSense D430", ""},
    {0x8086, 0x0b07, "Intel RealSense D435", ""},
    {0x8086, 0x0b3a, "Intel RealSense D435i", ""},
    {0x8086, 0x0b5b, "Intel RealSense D405", ""},
    {0x8086, 0x0b5c, "Intel RealSense D455", ""},
    {0x8086, 0x1155, "Intel RealSense D421", ""},
    {0x8086, 0x1156, "Intel RealSense D436", ""},
    {0x2bc5, 0x0800, "Orbbec Gemini 335", ""},
    {0x2bc5, 0x0801, "Orbbec Gemini 330", ""},
    {0x2bc5, 0x0803, "Orbbec Gemini 336", ""},
    {0x2bc5, 0x0804, "Orbbec Gemini 335L", ""},
    {0x2bc5, 0x0807, "Orbbec Gemini 336L", ""},
    {0x2bc5, 0x0669, "Orbbec Femto Mega", ""},
    {0x2bc5, 0x066b, "Orbbec Femto Bolt", kDepthByVendor},
    {0x045e, 0x097c, "Azure Kinect", kDepthByVendor},
    {0x045e, 0x097d, "Azure Kinect, colour camera", "it delivers no depth"},
    {0x045e, 0x02c4, "Kinect v2", kLibfreenect2},
    {0x045e, 0x02d8, "Kinect v2", kLibfreenect2},
    {0x03e7, 0x2485, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63b, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63c, "Luxonis OAK-D", kOwnProtocol},
    {0x03e7, 0xf63d, "Luxonis OAK-D", kOwnProtocol},
    {0x2b03, kAnyProduct, "Stereolabs ZED", kTwoViews},
}};

}  // namespace

const KnownCamera* knownCamera(std::uint16_t vendor, std::uint16_t product) {
  const auto* const known = std::ranges::find_if(kCameras, [&](const KnownCamera& it) {
    return it.vendor == vendor && (it.product == kAnyProduct || it.product == product);
  });
  return known == kCameras.end() ? nullptr : known;
}

namespace {

using drivers::VideoDevice;

constexpr const char* kKinect = "Kinect v1";

/// The video nodes of one device.
struct Nodes {
  std::string usb;  ///< empty: not a USB device
  std::vector<VideoDevice> videos;
};

/// A camera with its first node that delivers depth.
struct Examined {
  ConnectedCamera camera;
  std::string depth_node;  ///< empty: none
};

std::string usbPlaceOf(const VideoDevice& video) {
  return video.usb_interface.substr(0, video.usb_interface.find(':'));
}

std::uint16_t idFrom(const std::string& digits) {
  std::uint16_t id = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
  return id;
}

bool isKinectNode(const VideoDevice& video) {
  return fmt::format("{:04x}", video.vendor) == kKinectVendor &&
         std::ranges::find(kKinectCameras, fmt::format("{:04x}", video.product)) != kKinectCameras.end();
}

/// The video nodes by device; without those of a Kinect, whose driver of hapticd does not need them.
std::vector<Nodes> nodesByDevice(const std::vector<VideoDevice>& videos) {
  std::vector<Nodes> devices;
  for (const VideoDevice& video : videos) {
    if (isKinectNode(video)) continue;
    const std::string usb = usbPlaceOf(video);
    const auto device =
        std::ranges::find_if(devices, [&](const Nodes& it) { return !usb.empty() && it.usb == usb; });
    if (device == devices.end()) {
      devices.push_back({usb, {video}});
    } else {
      device->videos.push_back(video);
    }
  }
  return devices;
}

Examined examined(const Nodes& device, const DepthProbe& probe, const HeldCamera& held) {
  const VideoDevice& first = device.videos.front();
  const KnownCamera* const known = knownCamera(first.vendor, first.product);
  Examined result;
  ConnectedCamera& camera = result.camera;
  camera.is_known = known != nullptr;
  camera.name = base::printable(known ? known->name : first.name);
  camera.place = first.node;
  camera.usb = device.usb;
  camera.serial = base::printable(first.serial);
  camera.note = "it delivers no depth in the formats Z16 and Y16";
  if (!probe && known && *known->obstacle == '\0') result.depth_node = first.node;
  if (!held.node.empty() &&
      std::ranges::find(device.videos, held.node, &VideoDevice::node) != device.videos.end()) {
    result.depth_node = held.node;
    camera.format = base::printable(held.format);
  }
  for (const VideoDevice& video : device.videos) {
    if (!probe || !result.depth_node.empty()) break;
    const auto format = probe(video);
    if (!format) camera.note = format.error().text();
    if (!format || *format == 0) continue;
    camera.format = drivers::fourccText(*format);
    result.depth_node = video.node;
  }
  if (!result.depth_node.empty()) {
    camera.suitability = Suitability::usable;
    camera.driver = "v4l2";
    camera.place = result.depth_node;
    camera.note.clear();
  } else if (known && *known->obstacle != '\0') {
    camera.note = known->obstacle;
  }
  return result;
}

ConnectedCamera kinectAt(const UsbDevice& device) {
  ConnectedCamera camera;
  camera.suitability = Suitability::usable;
  camera.name = kKinect;
  camera.place = device.text();
  camera.driver = "freenect";
  camera.usb = device.name;
  return camera;
}

/// A depth camera by its ids of which the kernel shows no video device.
std::optional<ConnectedCamera> cameraWithoutNode(const Machine& machine, const UsbDevice& device) {
  const KnownCamera* const known = knownCamera(idFrom(device.vendor), idFrom(device.product));
  if (!known) return std::nullopt;
  ConnectedCamera camera;
  camera.is_known = true;
  camera.name = known->name;
  camera.place = device.text();
  camera.usb = device.name;
  camera.note =
      *known->obstacle != '\0' ? known->obstacle
      : machine.exists("sys/module/uvcvideo")
          ? "the kernel finds no video in its description: see journalctl -k, unplug it and plug it in again"
          : "the kernel shows no video device of it: modprobe uvcvideo";
  return camera;
}

/// The node that the driver v4l2 takes.
void chooseNode(CameraList& list, const std::vector<Examined>& found, const config::CameraSettings& settings,
                const std::vector<VideoDevice>& videos) {
  const auto candidates = drivers::candidatesOf(settings, videos);
  if (!candidates) {
    list.problem = candidates.error().text();
    return;
  }
  for (const VideoDevice& video : *candidates) {
    const auto camera = std::ranges::find(found, video.node, &Examined::depth_node);
    if (camera == found.end()) continue;
    list.source = video.node;
    return;
  }
  list.problem = "none of the video devices that the configuration allows delivers depth";
}

void chooseKinect(CameraList& list, const config::CameraSettings& settings) {
  const auto kinect = std::ranges::find(list.cameras, "freenect", &ConnectedCamera::driver);
  if (kinect == list.cameras.end()) {
    list.problem = "there is no Kinect v1 on USB (plug it into a USB port and into its own power supply)";
  } else if (settings.serial.empty()) {
    list.source = kinect->place;
  } else {
    list.source = "the Kinect v1 with the serial number " + settings.serial;
  }
}

void choose(CameraList& list, const std::vector<Examined>& found, const config::CameraSettings& settings,
            const std::vector<VideoDevice>& videos) {
  if (settings.driver == "v4l2") return chooseNode(list, found, settings, videos);
  if (settings.driver == "freenect") return chooseKinect(list, settings);
  list.source = config::driverOf(settings).source(settings);
}

/// What to set so that hapticd uses the camera.
std::string remedyFor(const ConnectedCamera& camera, const config::CameraSettings& settings) {
  const bool is_driver = camera.driver == settings.driver;
  if (!is_driver) return fmt::format("set camera.driver to {}", camera.driver);
  if (camera.driver == "freenect") return "camera.serial chooses one of several";
  return camera.serial.empty() ? fmt::format("set camera.device to {}", camera.place)
                               : fmt::format("set camera.serial to {}", camera.serial);
}

}  // namespace

base::Result<std::uint32_t> depthFormatOf(const VideoDevice& video) {
  drivers::KernelCalls calls;
  const drivers::OpenDevice device(calls, calls.open(video.node));
  if (device.descriptor() < 0) return std::unexpected(drivers::callFailure("open", device.descriptor()));
  const auto capability = drivers::capabilityOf(device);
  if (!capability) return std::unexpected(capability.error());
  return capability->depth_format;
}

CameraList listCameras(const Machine& machine, const config::CameraSettings& settings,
                       const DepthProbe& probe, const HeldCamera& held) {
  const std::vector<VideoDevice> videos = drivers::videoDevices(machine.root());
  std::vector<Examined> found;
  for (const Nodes& device : nodesByDevice(videos)) found.push_back(examined(device, probe, held));
  CameraList list;
  for (const Examined& it : found) list.cameras.push_back(it.camera);
  for (const UsbDevice& device : usbDevices(machine).value_or(std::vector<UsbDevice>{})) {
    const bool has_node =
        std::ranges::find(list.cameras, device.name, &ConnectedCamera::usb) != list.cameras.end();
    if (device.isKinectCamera()) {
      list.cameras.push_back(kinectAt(device));
    } else if (auto camera = has_node ? std::nullopt : cameraWithoutNode(machine, device)) {
      list.cameras.push_back(std::move(*camera));
    }
  }
  choose(list, found, settings, videos);
  if (!held.node.empty()) {
    list.source = held.node;
    list.problem.clear();
  }
  for (ConnectedCamera& camera : list.cameras) {
    if (camera.suitability != Suitability::usable) continue;
    if (camera.place == list.source) {
      camera.suitability = Suitability::used;
    } else {
      camera.note = remedyFor(camera, settings);
    }
  }
  return list;
}

namespace {

std::string lineOf(const ConnectedCamera& camera) {
  std::string text = fmt::format("{:<9} {}: {}", rt::wordOf(camera.suitability), camera.place, camera.name);
  if (!camera.serial.empty()) text += ", serial number " + camera.serial;
  if (!camera.format.empty()) text += ", depth in " + camera.format;
  if (!camera.note.empty()) text += fmt::format(" ({})", camera.note);
  return text + "\n";
}

}  // namespace

std::string textOf(const CameraList& list) {
  std::string text;
  for (const ConnectedCamera& camera : list.cameras) text += lineOf(camera);
  if (list.cameras.empty()) text += "no camera is connected\n";
  text += list.problem.empty() ? fmt::format("hapticd takes its depth from {}{}\n", list.source,
                                             list.state.empty() ? "" : ": " + list.state)
                               : fmt::format("hapticd finds no camera: {}\n", list.problem);
  return text + (list.configuration.empty() ? "" : fmt::format("configuration: {}\n", list.configuration));
}

std::string jsonOf(const CameraList& list) {
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const ConnectedCamera& camera : list.cameras) {
    cameras.push_back({{"suitability", rt::wordOf(camera.suitability)},
                       {"name", camera.name},
                       {"place", camera.place},
                       {"driver", camera.driver},
                       {"serial", camera.serial},
                       {"format", camera.format},
                       {"note", camera.note}});
  }
  return nlohmann::ordered_json{{"cameras", cameras},
                                {"source", list.source},
                                {"state", list.state},
                                {"problem", list.problem},
                                {"configuration", list.configuration}}
             .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

namespace {

constexpr int kBytesPerPixel = 2;
/// What bulk transfers reach of the nominal rate: about 36 of 60 MB/s on USB 2, 380 of 625 MB/s on USB 3.
constexpr double kUsableShare = 0.6;
constexpr double kBitsPerByte = 8;

Finding bandwidthFinding(const Examination& box, const ConnectedCamera& camera) {
  const config::CameraSettings& settings = box.configuration.settings.camera;
  const rt::DepthModelParameters frame = settings.effectiveDepthModel();
  const double rate_hz = config::driverOf(settings).rate_hz(settings);
  const double needed_mb_s = 1e-6 * kBytesPerPixel * frame.width_px * frame.height_px * rate_hz;
  const std::string needs = fmt::format("{} x {} at {} Hz takes {:.1f} MB/s", frame.width_px, frame.height_px,
                                        rate_hz, needed_mb_s);
  const auto devices = usbDevices(box.machine).value_or(std::vector<UsbDevice>{});
  const auto device = std::ranges::find(devices, camera.usb, &UsbDevice::name);
  if (camera.usb.empty() || device == devices.end()) return good(needs);
  double speed_mbit_s = 0;
  const std::string& speed = device->speed_mbit_s;
  std::from_chars(speed.data(), speed.data() + speed.size(), speed_mbit_s);
  const std::string fact =
      fmt::format("{} of a link with {} Mbit/s", needs, speed.empty() ? "an unknown number of" : speed);
  if (speed_mbit_s <= 0 || needed_mb_s <= kUsableShare * speed_mbit_s / kBitsPerByte) return good(fact);
  return failure(fact + ": more than it carries",
                 "plug the camera into a USB 3 port with a USB 3 cable, or set camera.width_px, "
                 "camera.height_px and camera.rate_hz to a smaller mode");
}

/// Whether only the daemon's group may open a camera.
Findings accessOf(const Examination& box, const std::string& camera, const std::string& node) {
  return accessFindings(box, camera, node).orElse(good("for the group hapticd only"));
}

Findings findingsOfUsed(const Examination& box, const ConnectedCamera& camera) {
  Findings findings = good(fmt::format("{} at {}{}{}", camera.name, camera.place,
                                       camera.format.empty() ? "" : ", " + camera.format,
                                       camera.serial.empty() ? "" : ", serial number " + camera.serial));
  findings.add(named("depth camera bandwidth", bandwidthFinding(box, camera)));
  findings.add(named("depth camera access", accessOf(box, camera.name, camera.place.substr(1))));
  return findings;
}

Finding moduleFinding(const Examination& box) {
  if (box.machine.exists("sys/module/uvcvideo")) return good("loaded");
  return warning("the kernel's driver of USB cameras is not loaded", "modprobe uvcvideo");
}

}  // namespace

Findings checkCameras(const Examination& box) {
  const config::CameraSettings& settings = box.configuration.settings.camera;
  const DeviceInUse& in_use = box.daemon.camera;
  const CameraList list = listCameras(box.machine, settings, box.depth_probe, {in_use.node, in_use.format});
  Findings findings = findingsOfInUse(in_use);
  for (const ConnectedCamera& camera : list.cameras) {
    if (!camera.is_known || camera.suitability != Suitability::unusable) continue;
    findings.push_back(
        warning(fmt::format("{} at {} cannot be used: {}", camera.name, camera.place, camera.note), ""));
  }
  if (settings.driver != "v4l2")
    return findings.orElse(good(fmt::format("no V4L2 camera in use: camera.driver is {}", settings.driver)));
  findings.add(named("uvcvideo", moduleFinding(box)));
  const auto used = std::ranges::find(list.cameras, Suitability::used, &ConnectedCamera::suitability);
  if (used == list.cameras.end()) {
    if (in_use.state.empty())
      findings.push_back(warning(list.problem, "hapticctl camera list shows what is connected"));
    return findings;
  }
  findings.add(findingsOfUsed(box, *used));
  return findings;
}

namespace {

constexpr std::ptrdiff_t kManyNeighbours = 4;

Finding absenceFinding(const std::vector<UsbDevice>& devices) {
  if (std::ranges::any_of(devices, &UsbDevice::isKinectPart)) {
    return warning("its motor or microphone is on USB, but not its camera",
                   "plug in the Kinect's own power supply: USB alone does not power the camera");
  }
  return warning("there is none on USB", "plug it into a USB port and into its own power supply");
}

Finding speedFinding(const UsbDevice& camera) {
  const std::string fact = fmt::format("{}, {} Mbit/s", camera.text(), camera.speed_mbit_s);
  if (camera.speed_mbit_s == "480") return good(fact);
  return failure(fact + ": too slow for depth, which takes 480",
                 "plug it into another port, without a hub or an extension");
}

Finding suspendFinding(const UsbDevice& camera) {
  if (camera.power_control == "on") return good("off");
  return warning(
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
  if (neighbours < kManyNeighbours) return good(fact);
  return warning(fact + ": depth packets may be lost",
                 "plug the Kinect into a port of another controller; lsusb -t shows them");
}

Finding driverFinding(const Machine& machine, const UsbDevice& camera) {
  const std::string driver = driverOf(machine, camera);
  if (driver.empty()) return good("no kernel driver uses it");
  if (driver == "usbfs") return good("usbfs: a program uses it now");
  return good(driver + ": harmless, hapticd takes the camera over");
}

}  // namespace

Findings checkKinect(const Examination& box) {
  const Reading<std::vector<UsbDevice>> devices = usbDevices(box.machine);
  if (!devices) return devices.error();
  Findings findings;
  for (const UsbDevice& camera : *devices) {
    if (!camera.isKinectCamera()) continue;
    findings.push_back(speedFinding(camera));
    findings.add(named("kinect access", accessOf(box, camera.text(), camera.node())));
    findings.add(named("kinect autosuspend", suspendFinding(camera)));
    findings.add(named("kinect bus", busFinding(*devices, camera)));
    findings.add(named("kinect driver", driverFinding(box.machine, camera)));
  }
  if (!findings.empty()) return findings;
  const std::string& driver = box.configuration.settings.camera.driver;
  if (driver == "freenect") return absenceFinding(*devices);
  return good(fmt::format("there is none on USB, and camera.driver is {}", driver));
}

}  // namespace hapticd::tools
