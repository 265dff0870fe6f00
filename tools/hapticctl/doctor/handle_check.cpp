// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "config/settings/driver_rows.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "handle";

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
  if (!table) return {unreadable(kName, "proc/net/udp", table.error())};
  const bool in_use = isPortInUse(*table, need.port);
  if (in_use == box.daemon.answers) {
    return {
        good(kName, fmt::format("UDP port {} is {}", need.port, in_use ? "hapticd's" : "free for hapticd"))};
  }
  if (!in_use) {
    return {warning(kName, fmt::format("hapticd runs, but nothing listens on UDP port {}", need.port),
                    "systemctl restart hapticd, if its configuration was changed since its start")};
  }
  return {warning(kName, fmt::format("UDP port {} is in use, and hapticd does not respond", need.port),
                  fmt::format("ss -ulpn 'sport = :{}' shows by whom; end that, or set another {}", need.port,
                              need.parameter))};
}

Findings NeedCheck::operator()(const config::FileNeed& need) const {
  if (need.path.empty()) {
    if (need.optional) return {};
    return {failureOfTheService(box, kName, fmt::format("no {} is configured", need.noun), need.remedy)};
  }
  const Reading<Access> access = box.machine.access(belowRoot(need.path));
  if (need.secret ? !access && access.error().absent() : !box.machine.exists(belowRoot(need.path))) {
    return {
        failureOfTheService(box, kName, fmt::format("there is no {} {}", need.noun, need.path), need.remedy)};
  }
  if (!need.secret) return {};
  if (!access) return {unreadable(kName, belowRoot(need.path), access.error())};
  if ((access->mode & 0007U) == 0) return {};
  return {failureOfTheService(box, kName, fmt::format("everyone may read the {} {}", need.noun, need.path),
                              fmt::format("chmod o= {0} && chgrp hapticd {0}", need.path))};
}

Findings NeedCheck::operator()(const config::HidNeed& need) const {
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return {unreadable(kName, "sys/class/hidraw", names.error())};
  for (const std::string& name : names.value_or(Names{})) {
    if (!isHidHandle(box, name)) continue;
    const Findings wrong = accessFindings(box, kName, need.device, "dev/" + name);
    return wrong.empty() ? Findings{good(kName, fmt::format("{} at /dev/{}", need.device, name))} : wrong;
  }
  return {warning(kName, fmt::format("the HID device {} is not connected", need.device),
                  fmt::format("plug it in, or correct {}; lsusb shows the numbers", need.parameter))};
}

Findings NeedCheck::operator()(const config::UsbNeed& need) const {
  const Reading<std::vector<UsbDevice>> devices = usbDevices(box.machine);
  if (!devices) return {unreadable(kName, "sys/bus/usb/devices", devices.error())};
  const auto found = std::ranges::find_if(*devices, [&need](const UsbDevice& device) {
    return device.vendor == need.vendor && device.product == need.product;
  });
  if (found == devices->end()) {
    return {warning(kName, fmt::format("there is no {} on USB", need.name), need.remedy)};
  }
  const Findings wrong = accessFindings(box, kName, found->text(), found->node());
  return wrong.empty() ? Findings{good(kName, fmt::format("{} {}", need.name, found->text()))} : wrong;
}

}  // namespace

Findings checkHandle(const Examination& box) {
  if (!box.configuration.problem.empty()) {
    return {warning(kName, "not examined, because the configuration cannot be used", "")};
  }
  const config::HandleSettings& handle = box.configuration.settings.handle;
  const std::vector<config::Need> needs = config::driverOf(handle).needs(handle);
  Findings findings = findingsOfInUse(kName, box.daemon.handle);
  if (needs.empty()) {
    if (findings.empty()) findings.push_back(good(kName, handle.driver + ", so there is no device"));
    return findings;
  }
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

}  // namespace hapticd::tools
