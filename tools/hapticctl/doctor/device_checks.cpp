#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/say.h"
#include "tools/hapticctl/doctor/udev_rule.h"

namespace hapticd::tools {
namespace {

constexpr const char* kOwnRules = "72-hapticd.rules";
constexpr const char* kRulesFolder = "usr/lib/udev/rules.d";

struct HidDevice {
  const char* id;  ///< vendor and product as the kernel writes them
  const char* name;
};

/// Those that systemd/72-hapticd.rules names.
constexpr std::array kHidDevices{
    HidDevice{"0000046D:0000C626", "SpaceNavigator"},
    HidDevice{"0000256F:0000C62E", "SpaceMouse Wireless"},
    HidDevice{"000016C0:00000486", "Teensy RawHID"},
};

/// What a node of hidraw belongs to, of the devices above; null for others.
const HidDevice* hidDeviceOf(const std::string& uevent) {
  const auto found = std::ranges::find_if(
      kHidDevices, [&](const HidDevice& device) { return uevent.find(device.id) != std::string::npos; });
  return found == kHidDevices.end() ? nullptr : &*found;
}

}  // namespace

Findings checkUdevRules(const Examination& box) {
  const Reading<std::vector<RulesFile>> files = rulesFiles(box.machine);
  if (!files) return {unreadable("udev rules", kRulesFolder, files.error())};
  const auto own = std::ranges::find(*files, kOwnRules, &RulesFile::name);
  if (own == files->end()) {
    return {badForTheService(box, "udev rules", fmt::format("{} is not installed", kOwnRules),
                             "install hapticd's package: without its rules no device belongs to hapticd")};
  }
  if (own->masked) {
    return {
        badForTheService(box, "udev rules", fmt::format("/{} switches hapticd's rules off", own->path),
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
      // an earlier rule is overruled by ours, unless it is final
      if (file.name < kOwnRules && !rule.final) continue;
      findings.push_back(
          doubtful("other udev rules",
                   fmt::format("/{} lets everyone use a Kinect, and wins over hapticd's", rule.file),
                   fmt::format("ln -s /dev/null /etc/udev/rules.d/{}, then udevadm control --reload "
                               "&& udevadm trigger",
                               file.name)));
      break;
    }
  }
  if (findings.empty()) findings.push_back(good("other udev rules", "none gives a Kinect to everyone"));
  return findings;
}

Findings checkHid(const Examination& box) {
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return {unreadable("hid", "sys/class/hidraw", names.error())};
  Findings findings;
  for (const std::string& name : names.value_or(Names{})) {
    const Reading<std::string> uevent = box.machine.read("sys/class/hidraw/" + name + "/device/uevent");
    const HidDevice* device = uevent ? hidDeviceOf(*uevent) : nullptr;
    if (!device) continue;
    const Findings wrong = accessFindings(box, "hid", device->name, "dev/" + name);
    findings.insert(findings.end(), wrong.begin(), wrong.end());
    if (wrong.empty()) findings.push_back(good("hid", fmt::format("{} at /dev/{}", device->name, name)));
  }
  if (findings.empty()) findings.push_back(good("hid", "no handle that hapticd knows is on hidraw"));
  return findings;
}

Findings checkGpio(const Examination& box) {
  const Reading<Names> names = box.machine.list("dev");
  if (!names) return {unreadable("gpio", "dev", names.error())};
  Findings findings;
  std::vector<std::string> usable;
  for (const std::string& name : *names) {
    if (!name.starts_with("gpiochip")) continue;
    const Findings wrong = accessFindings(box, "gpio", name, "dev/" + name);
    findings.insert(findings.end(), wrong.begin(), wrong.end());
    if (wrong.empty()) usable.push_back(name);
  }
  // a box without LEDs works too
  for (Finding& finding : findings) finding.verdict = Verdict::warn;
  if (!usable.empty()) findings.push_back(good("gpio", "for the group hapticd: " + someOf(usable)));
  if (findings.empty()) findings.push_back(good("gpio", "there are no GPIO chips, so no LEDs on them"));
  return findings;
}

}  // namespace hapticd::tools
