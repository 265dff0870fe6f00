// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"
#include "tools/hapticctl/doctor/handle_list.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "vendor handle";

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
  return {warning(kName, fmt::format("there is no {} in /usr/local/lib or /usr/lib", library->file),
                  fmt::format("install the vendor's software, or give haptic-bridge {} the option "
                              "--library",
                              bridge))};
}

/// A bridge may run as any user, so that it is not known whether a device is kept from it.
Findings checkRights(const Examination& box, const ConnectedHandle& handle) {
  if (handle.node.empty()) return {};
  const Reading<Access> access = box.machine.access(handle.node);
  if (!access) return {unreadable(kName, handle.node, access.error())};
  const std::string fact = fmt::format("{}: /{} has mode {:04o}", handle.name, handle.node, access->mode);
  const std::string remedy =
      "copy 73-vendor-handles.rules from /usr/share/doc/hapticd/examples to /etc/udev/rules.d and remove the "
      "vendor's own, then udevadm control --reload && udevadm trigger --action=change";
  if ((access->mode & (S_IROTH | S_IWOTH)) != 0)
    return {warning(kName, fact + ", so that everyone may use it", remedy)};
  const auto group = box.machine.group(kVendorGroup);
  const bool is_of_group = group && group->has_value() && (*group)->id == access->group;
  if (is_of_group && (access->mode & S_IRGRP) != 0 && (access->mode & S_IWGRP) != 0) return {};
  return {warning(
      kName, fmt::format("{}, so that a bridge of the group {} cannot use it", fact, kVendorGroup), remedy)};
}

Findings checkInverseService(const Examination& box, const ConnectedHandle& handle) {
  if (handle.bridge != "inverse3") return {};
  const Reading<std::string> table = box.machine.read("proc/net/tcp");
  if (!table) return {unreadable(kName, "proc/net/tcp", table.error())};
  constexpr std::string_view kListens = "0A";
  if (isPortInUse(*table, kInversePort, kListens)) return {};
  return {warning(kName, fmt::format("the Haply Inverse Service does not listen on port {}", kInversePort),
                  "systemctl start haply-inverse-service")};
}

Findings checkOne(const Examination& box, const ConnectedHandle& handle) {
  Findings findings = checkRights(box, handle);
  for (Finding& finding : checkLibrary(box, handle.bridge)) findings.push_back(std::move(finding));
  for (Finding& finding : checkInverseService(box, handle)) findings.push_back(std::move(finding));
  if (!findings.empty()) return findings;
  Finding all_right = good(kName, fmt::format("{} ({})", handle.name, handle.place));
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
    if (handle.bridge.empty()) continue;
    for (Finding& finding : checkOne(box, handle)) findings.push_back(std::move(finding));
  }
  if (findings.empty()) findings.push_back(good(kName, "none that needs haptic-bridge is connected"));
  return findings;
}

}  // namespace hapticd::tools
