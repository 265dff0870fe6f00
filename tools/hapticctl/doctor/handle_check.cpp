// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "handle";
constexpr const char* kFalconVendor = "0403";
constexpr const char* kFalconProduct = "cb48";

/// Converts a path of the configuration, which begins with '/', to one of a Machine, which does not.
std::string belowRoot(const std::string& path) {
  return path.starts_with('/') ? path.substr(1) : path;
}

// --- a device on another computer

/// The local ports in /proc/net/udp, whose second column is "address:port" in hexadecimal.
bool isPortInUse(const std::string& table, int port) {
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);  // the titles of the columns
  while (std::getline(lines, line)) {
    std::istringstream columns(line);
    std::string number, local;
    columns >> number >> local;
    const std::size_t colon = local.find(':');
    int used = 0;
    if (colon == std::string::npos) continue;
    std::from_chars(local.data() + colon + 1, local.data() + local.size(), used, 16);
    if (used == port) return true;
  }
  return false;
}

Finding portFinding(const Examination& box, int port) {
  const Reading<std::string> table = box.machine.read("proc/net/udp");
  if (!table) return unreadable(kName, "proc/net/udp", table.error());
  const bool in_use = isPortInUse(*table, port);
  if (in_use == box.daemon.answers) {
    return good(kName, fmt::format("UDP port {} is {}", port, in_use ? "hapticd's" : "free for hapticd"));
  }
  if (!in_use) {
    return warning(kName, fmt::format("hapticd runs, but nothing listens on UDP port {}", port),
                   "systemctl restart hapticd, if its configuration was changed since its start");
  }
  return warning(
      kName, fmt::format("UDP port {} is in use, and hapticd does not respond", port),
      fmt::format("ss -ulpn 'sport = :{}' shows by whom; end that, or set another udp_handle.port", port));
}

Findings keyFindings(const Examination& box, const std::string& file) {
  if (file.empty()) return {};
  const Reading<Access> access = box.machine.access(belowRoot(file));
  if (!access && access.error().absent()) {
    return {failureOfTheService(box, kName, fmt::format("there is no key {}", file),
                                "put the key there that both sides share, or correct udp_handle.key_file")};
  }
  if (!access) return {unreadable(kName, belowRoot(file), access.error())};
  if ((access->mode & 0007U) == 0) return {};
  return {warning(kName, fmt::format("everyone may read the key {}", file),
                  fmt::format("chmod o= {0} && chgrp hapticd {0}", file))};
}

Findings udpFindings(const Examination& box) {
  const config::UdpHandleSettings& udp = box.configuration.settings.handle.udp;
  Findings findings{portFinding(box, udp.port)};
  for (Finding& finding : keyFindings(box, udp.key_file)) findings.push_back(std::move(finding));
  return findings;
}

// --- devices on this machine

Findings hidFindings(const Examination& box) {
  const std::string& device = box.configuration.settings.handle.hid.device;
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return {unreadable(kName, "sys/class/hidraw", names.error())};
  for (const std::string& name : names.value_or(Names{})) {
    if (!isHidHandle(box, name)) continue;
    const Findings wrong = accessFindings(box, kName, device, "dev/" + name);
    return wrong.empty() ? Findings{good(kName, fmt::format("{} at /dev/{}", device, name))} : wrong;
  }
  return {warning(kName, fmt::format("the HID device {} is not connected", device),
                  "plug it in, or correct hid_handle.device; lsusb shows the numbers")};
}

Findings firmwareFindings(const Examination& box) {
  const std::string& file = box.configuration.settings.handle.falcon.firmware;
  if (!file.empty() && box.machine.exists(belowRoot(file))) return {};
  return {failureOfTheService(box, kName,
                              file.empty() ? "no firmware is configured" : "there is no firmware " + file,
                              "put the device's firmware there and set falcon_handle.firmware")};
}

Findings falconFindings(const Examination& box) {
  Findings findings = firmwareFindings(box);
  const Reading<std::vector<UsbDevice>> devices = usbDevices(box.machine);
  if (!devices) return {unreadable(kName, "sys/bus/usb/devices", devices.error())};
  const auto falcon = std::ranges::find_if(*devices, [](const UsbDevice& device) {
    return device.vendor == kFalconVendor && device.product == kFalconProduct;
  });
  if (falcon == devices->end()) {
    findings.push_back(warning(kName, "there is no Falcon on USB", "plug it in, and its own power supply"));
    return findings;
  }
  for (Finding& finding : accessFindings(box, kName, falcon->text(), falcon->node())) {
    findings.push_back(std::move(finding));
  }
  if (findings.empty()) findings.push_back(good(kName, "Falcon " + falcon->text()));
  return findings;
}

}  // namespace

Findings checkHandle(const Examination& box) {
  if (!box.configuration.problem.empty()) {
    return {failureOfTheService(box, kName, "the configuration cannot be used: " + box.configuration.problem,
                                "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml --check")};
  }
  switch (box.configuration.settings.handle.driver) {
    case config::HandleDriver::udp:
      return udpFindings(box);
    case config::HandleDriver::hid:
      return hidFindings(box);
    case config::HandleDriver::falcon:
      return falconFindings(box);
    case config::HandleDriver::simulated:
      break;
  }
  return {good(kName, "simulated, so there is no device")};
}

}  // namespace hapticd::tools
