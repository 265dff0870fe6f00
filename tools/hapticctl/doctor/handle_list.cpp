// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/handle_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "tools/hapticctl/doctor/devices.h"

namespace hapticd::tools {
namespace {

constexpr const char* kUdp = "udp";

/// A handle on USB. Ids: of the Falcon, libnifalcon; of the others, the udev rules of their vendors.
struct KnownHandle {
  std::string_view vendor;   ///< four hexadecimal digits
  std::string_view product;  ///< empty: all of the vendor
  const char* name;
  const char* driver;
  const char* bridge;  ///< the kind of haptic-bridge; empty: hapticd drives it itself
};
constexpr std::array kKnown{
    KnownHandle{"0403", "cb48", "Novint Falcon", "falcon", ""},
    KnownHandle{"1451", "", "Force Dimension omega, delta, sigma or lambda", kUdp, "force-dimension"},
    KnownHandle{"2988", "", "3D Systems Touch or Touch X", kUdp, "openhaptics"}};

constexpr const char* kPhantomVendor = "0x000b99";  // in the GUID of a Phantom on FireWire
constexpr std::array kHaplyUnits{"usr/lib/systemd/system/haply-inverse-service.service",
                                 "lib/systemd/system/haply-inverse-service.service",
                                 "etc/systemd/system/haply-inverse-service.service"};

std::string bridgeNote(std::string_view kind) {
  return fmt::format("set handle.driver to udp and run haptic-bridge {}", kind);
}

void addUsb(const Examination& box, HandleList& list) {
  for (const UsbDevice& device : usbDevices(box.machine).value_or(std::vector<UsbDevice>{})) {
    const auto* const known = std::ranges::find_if(kKnown, [&device](const KnownHandle& it) {
      return device.vendor == it.vendor && (it.product.empty() || device.product == it.product);
    });
    if (known == kKnown.end()) continue;
    const bool bridged = *known->bridge != '\0';
    list.handles.push_back(
        {Suitability::usable, known->name, device.text(), known->driver,
         bridged ? bridgeNote(known->bridge) : fmt::format("set handle.driver to {}", known->driver),
         known->bridge, device.node()});
  }
}

void addHid(const Examination& box, HandleList& list) {
  for (const std::string& node : box.machine.list("sys/class/hidraw").value_or(Names{})) {
    if (!isHidHandle(box, node)) continue;
    const std::string uevent = box.machine.read("sys/class/hidraw/" + node + "/device/uevent").value_or("");
    list.handles.push_back(
        {Suitability::used, variableOf(uevent, "HID_NAME"), "/dev/" + node, "hid", "", "", "dev/" + node});
  }
}

void addFireWire(const Examination& box, HandleList& list) {
  for (const std::string& node : box.machine.list("sys/bus/firewire/devices").value_or(Names{})) {
    if (box.machine.read("sys/bus/firewire/devices/" + node + "/vendor").value_or("") != kPhantomVendor)
      continue;
    list.handles.push_back({Suitability::usable, "SensAble Phantom on FireWire", "/dev/" + node, kUdp,
                            bridgeNote("phantom-omni") + "; for another Phantom than the Omni, openhaptics",
                            "phantom-omni", "dev/" + node});
  }
}

/// An Inverse3 has no ids of its own on USB that are known: its service finds it.
void addServices(const Examination& box, HandleList& list) {
  const auto* const unit =
      std::ranges::find_if(kHaplyUnits, [&box](const char* path) { return box.machine.exists(path); });
  if (unit == kHaplyUnits.end()) return;
  list.handles.push_back({Suitability::usable, "Haply Inverse Service", fmt::format("/{}", *unit), kUdp,
                          bridgeNote("inverse3"), "inverse3", ""});
}

}  // namespace

HandleList listHandles(const Examination& box) {
  HandleList list;
  list.source = box.configuration.settings.handle.driver;
  list.configuration = box.configuration.source;
  addUsb(box, list);
  addHid(box, list);
  addFireWire(box, list);
  addServices(box, list);
  for (ConnectedHandle& handle : list.handles) {
    if (handle.driver != list.source || handle.driver == kUdp) continue;
    handle.suitability = Suitability::used;
    handle.note.clear();
  }
  return list;
}

std::string textOf(const HandleList& list) {
  std::string text;
  for (const ConnectedHandle& handle : list.handles) {
    text += fmt::format("{:<9} {}: {}", rt::wordOf(handle.suitability), handle.place, handle.name);
    text += handle.note.empty() ? "\n" : fmt::format(" ({})\n", handle.note);
  }
  if (list.handles.empty()) text += "no handle that hapticd knows is connected\n";
  text +=
      fmt::format("hapticd uses the driver {}{}\n", list.source, list.state.empty() ? "" : ": " + list.state);
  return text + (list.configuration.empty() ? "" : fmt::format("configuration: {}\n", list.configuration));
}

std::string jsonOf(const HandleList& list) {
  nlohmann::ordered_json handles = nlohmann::ordered_json::array();
  for (const ConnectedHandle& handle : list.handles) {
    handles.push_back({{"suitability", rt::wordOf(handle.suitability)},
                       {"name", handle.name},
                       {"place", handle.place},
                       {"driver", handle.driver},
                       {"note", handle.note}});
  }
  return nlohmann::ordered_json{{"handles", handles},
                                {"source", list.source},
                                {"state", list.state},
                                {"configuration", list.configuration}}
             .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace hapticd::tools
