// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/handles.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include "config/settings/driver_rows.h"
#include "tools/hapticctl/doctor/checks.h"
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

namespace {

/// Converts a path of the configuration, which begins with '/', to one of a Machine, which does not.
std::string belowRoot(const std::string& path) {
  return path.starts_with('/') ? path.substr(1) : path;
}

/// One check for each kind of thing that a driver needs.
struct NeedCheck {
  const Examination& box;

  Findings operator()(const config::PortNeed& need) const;
  Findings operator()(const config::FileNeed& need) const;
  Findings operator()(const config::HidNeed& need) const;
  Findings operator()(const config::UsbNeed& need) const;
};

Findings NeedCheck::operator()(const config::PortNeed& need) const {
  const Reading<std::string> table = box.machine.read("proc/net/udp");
  if (!table) return table.error();
  const bool in_use = isPortInUse(*table, need.port);
  if (in_use == box.daemon.answers) {
    return good(fmt::format("UDP port {} is {}", need.port, in_use ? "hapticd's" : "free for hapticd"));
  }
  if (!in_use) {
    return warning(fmt::format("hapticd runs, but nothing listens on UDP port {}", need.port),
                   "systemctl restart hapticd, if its configuration was changed since its start");
  }
  return warning(fmt::format("UDP port {} is in use, and hapticd does not respond", need.port),
                 fmt::format("ss -ulpn 'sport = :{}' shows by whom; end that, or set another {}", need.port,
                             need.parameter));
}

Findings NeedCheck::operator()(const config::FileNeed& need) const {
  if (need.path.empty()) {
    if (need.optional) return {};
    return failureOfTheService(box, fmt::format("no {} is configured", need.noun), need.remedy);
  }
  const Reading<Access> access = box.machine.access(belowRoot(need.path));
  if (need.secret ? !access && access.error().absent() : !box.machine.exists(belowRoot(need.path))) {
    return failureOfTheService(box, fmt::format("there is no {} {}", need.noun, need.path), need.remedy);
  }
  if (!need.secret) return {};
  if (!access) return access.error();
  if ((access->mode & 0007U) == 0) return {};
  return failureOfTheService(box, fmt::format("everyone may read the {} {}", need.noun, need.path),
                             fmt::format("chmod o= {0} && chgrp hapticd {0}", need.path));
}

Findings NeedCheck::operator()(const config::HidNeed& need) const {
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return names.error();
  for (const std::string& name : names.value_or(Names{})) {
    if (!isHidHandle(box, name)) continue;
    return accessFindings(box, need.device, "dev/" + name)
        .orElse(good(fmt::format("{} at /dev/{}", need.device, name)));
  }
  return warning(fmt::format("the HID device {} is not connected", need.device),
                 fmt::format("plug it in, or correct {}; lsusb shows the numbers", need.parameter));
}

Findings NeedCheck::operator()(const config::UsbNeed& need) const {
  const Reading<std::vector<UsbDevice>> devices = usbDevices(box.machine);
  if (!devices) return devices.error();
  const auto found = std::ranges::find_if(*devices, [&need](const UsbDevice& device) {
    return device.vendor == need.vendor && device.product == need.product;
  });
  if (found == devices->end()) {
    return warning(fmt::format("there is no {} on USB", need.name), need.remedy);
  }
  return accessFindings(box, found->text(), found->node())
      .orElse(good(fmt::format("{} {}", need.name, found->text())));
}

}  // namespace

Findings checkHandle(const Examination& box) {
  if (!box.configuration.problem.empty()) {
    return warning("not examined, because the configuration cannot be used", "");
  }
  const config::HandleSettings& handle = box.configuration.settings.handle;
  const std::vector<config::Need> needs = config::driverOf(handle).needs(handle);
  Findings findings = findingsOfInUse(box.daemon.handle);
  if (needs.empty()) return findings.orElse(good(handle.driver + ", so there is no device"));
  bool is_well = true;  // what is as it should be does not matter after something that is not
  for (const config::Need& need : needs) {
    for (Finding& finding : std::visit(NeedCheck{box}, need)) {
      const bool is_ok = finding.verdict == Verdict::ok;
      if (is_well || !is_ok) findings.push_back(std::move(finding));
      is_well = is_well && is_ok;
    }
  }
  return findings;
}

namespace {

/// What haptic-bridge loads for a kind of device.
struct BridgeLibrary {
  std::string_view bridge;
  std::string_view file;  ///< begins with this; a version may follow
};
constexpr std::array kLibraries{BridgeLibrary{"force-dimension", "libdrd.so"},
                                BridgeLibrary{"openhaptics", "libHD.so"}};

/// Where a vendor's library is found without --library, of all that the loader looks at.
constexpr std::array kLibraryFolders{"usr/local/lib", "usr/lib", "usr/lib/x86_64-linux-gnu",
                                     "usr/lib/aarch64-linux-gnu", "usr/lib64"};

constexpr int kInversePort = 10001;

Findings checkLibrary(const Examination& box, const std::string& bridge) {
  const auto* const library = std::ranges::find(kLibraries, bridge, &BridgeLibrary::bridge);
  if (library == kLibraries.end()) return {};
  for (const char* folder : kLibraryFolders) {
    for (const std::string& file : box.machine.list(folder).value_or(Names{})) {
      if (file.starts_with(library->file)) return {};
    }
  }
  return warning(fmt::format("there is no {} in /usr/local/lib or /usr/lib", library->file),
                 fmt::format("install the vendor's software, or give haptic-bridge {} the option "
                             "--library",
                             bridge));
}

/// A bridge may run as any user, so that it is not known whether a device is kept from it.
Findings checkRights(const Examination& box, const ConnectedHandle& handle) {
  if (handle.node.empty()) return {};
  const Reading<Access> access = box.machine.access(handle.node);
  if (!access) return access.error();
  const std::string fact = fmt::format("{}: /{} has mode {:04o}", handle.name, handle.node, access->mode);
  const std::string remedy =
      "copy 73-vendor-handles.rules from /usr/share/doc/hapticd/examples to /etc/udev/rules.d and remove the "
      "vendor's own, then udevadm control --reload && udevadm trigger --action=change";
  if ((access->mode & (S_IROTH | S_IWOTH)) != 0)
    return warning(fact + ", so that everyone may use it", remedy);
  const auto group = box.machine.group(kVendorGroup);
  const bool is_of_group = group && group->has_value() && (*group)->id == access->group;
  if (is_of_group && (access->mode & S_IRGRP) != 0 && (access->mode & S_IWGRP) != 0) return {};
  return warning(fmt::format("{}, so that a bridge of the group {} cannot use it", fact, kVendorGroup),
                 remedy);
}

Findings checkInverseService(const Examination& box, const ConnectedHandle& handle) {
  if (handle.bridge != "inverse3") return {};
  const Reading<std::string> table = box.machine.read("proc/net/tcp");
  if (!table) return table.error();
  constexpr std::string_view kListens = "0A";
  if (isPortInUse(*table, kInversePort, kListens)) return {};
  return warning(fmt::format("the Haply Inverse Service does not listen on port {}", kInversePort),
                 "systemctl start haply-inverse-service");
}

Findings checkOne(const Examination& box, const ConnectedHandle& handle) {
  Findings findings = checkRights(box, handle);
  findings.add(checkLibrary(box, handle.bridge));
  findings.add(checkInverseService(box, handle));
  if (!findings.empty()) return findings;
  Finding all_right = good(fmt::format("{} ({})", handle.name, handle.place));
  if (box.configuration.settings.handle.driver != handle.driver) {
    all_right.fact += ", which hapticd does not use";
    all_right.remedy = handle.note;
  }
  return {all_right};
}

}  // namespace

Findings checkVendorHandles(const Examination& box) {
  Findings findings;
  for (const ConnectedHandle& handle : listHandles(box).handles) {
    if (!handle.bridge.empty()) findings.add(checkOne(box, handle));
  }
  return findings.orElse(good("none that needs haptic-bridge is connected"));
}

}  // namespace hapticd::tools
