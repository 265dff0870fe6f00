// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/findings.h"
#include "tools/hapticctl/doctor/named_device.h"
#include "tools/hapticctl/doctor/udev_rule.h"
#include "tools/hapticctl/doctor/uevent.h"

namespace hapticd::tools {
namespace {

constexpr const char* kOwnRules = "72-hapticd.rules";
constexpr const char* kRulesFolder = "usr/lib/udev/rules.d";

}  // namespace

Findings checkUdevRules(const Examination& box) {
  const Reading<std::vector<RulesFile>> files = rulesFiles(box.machine);
  if (!files) return {unreadable("udev rules", kRulesFolder, files.error())};
  const auto own = std::ranges::find(*files, kOwnRules, &RulesFile::name);
  if (own == files->end()) {
    return {failureOfTheService(box, "udev rules", fmt::format("{} is not installed", kOwnRules),
                                "install hapticd's package: without its rules no device belongs to hapticd")};
  }
  if (own->masked) {
    return {failureOfTheService(
        box, "udev rules", fmt::format("/{} switches hapticd's rules off", own->path),
        fmt::format("rm /{}, then udevadm control --reload && udevadm trigger", own->path))};
  }
  return {good("udev rules", "/" + own->path)};
}

Findings checkOtherRules(const Examination& box) {
  const Reading<std::vector<RulesFile>> files = rulesFiles(box.machine);
  if (!files) return {unreadable("other udev rules", kRulesFolder, files.error())};
  Findings findings;
  for (const RulesFile& file : *files) {
    if (file.name == kOwnRules) continue;
    for (const OpenRule& rule : openKinectRules(box.machine, file)) {
      // our rule overrides an earlier one, unless that is final
      if (file.name < kOwnRules && !rule.final) continue;
      findings.push_back(
          warning("other udev rules",
                  fmt::format("/{} lets everyone use a Kinect, and overrides hapticd's", rule.file),
                  fmt::format("ln -s /dev/null /etc/udev/rules.d/{}, then udevadm control --reload "
                              "&& udevadm trigger",
                              file.name)));
      break;
    }
  }
  if (findings.empty()) findings.push_back(good("other udev rules", "none lets everyone use a Kinect"));
  return findings;
}

/// The HID devices that a udev rule gives to the group hapticd: only these rules determine which devices
/// are handles.
Findings checkHid(const Examination& box) {
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return {unreadable("hid", "sys/class/hidraw", names.error())};
  const std::vector<RulesFile> files = rulesFiles(box.machine).value_or(std::vector<RulesFile>{});
  Findings findings;
  for (const std::string& name : names.value_or(Names{})) {
    const std::string uevent = box.machine.read("sys/class/hidraw/" + name + "/device/uevent").value_or("");
    const std::string id = variableOf(uevent, "HID_ID");
    const bool is_handle = isHidHandle(box, name);
    if (std::ranges::none_of(
            files, [&](const RulesFile& file) { return givesHidDevice(box.machine, file, id, is_handle); })) {
      continue;
    }
    const std::string device = variableOf(uevent, "HID_NAME");
    const Findings wrong = accessFindings(box, "hid", device, "dev/" + name);
    findings.insert(findings.end(), wrong.begin(), wrong.end());
    if (wrong.empty()) findings.push_back(good("hid", fmt::format("{} at /dev/{}", device, name)));
  }
  if (findings.empty()) findings.push_back(good("hid", "no handle that udev gives to hapticd is on hidraw"));
  return findings;
}

}  // namespace hapticd::tools
