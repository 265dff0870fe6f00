// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/findings.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {
namespace {

/// A file of udev rules that is in force.
struct RulesFile {
  std::string name;     ///< "72-hapticd.rules"; udev reads the files in the order of their names
  std::string path;     ///< without the leading slash
  bool masked = false;  ///< empty, which switches off a file of the same name
};

/// A rule that lets everyone use a Kinect.
struct OpenRule {
  std::string file;
  bool final = false;  ///< set with ":=", so that no later rule changes it
};

/// The folders of rules, the one with the highest precedence first.
constexpr std::array kFolders{"etc/udev/rules.d/", "run/udev/rules.d/", "usr/local/lib/udev/rules.d/",
                              "usr/lib/udev/rules.d/", "lib/udev/rules.d/"};

/// The rules in lower case; a line that ends with a backslash is joined to the next one.
std::vector<std::string> rulesIn(const std::string& content) {
  std::vector<std::string> rules;
  std::string rule;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    std::ranges::transform(line, line.begin(), [](unsigned char letter) { return std::tolower(letter); });
    const bool goes_on = line.ends_with('\\');
    rule += goes_on ? line.substr(0, line.size() - 1) : line;
    if (goes_on) continue;
    if (!rule.empty() && rule.front() != '#') rules.push_back(rule);
    rule.clear();
  }
  return rules;
}

/// The quoted value after `key`; nothing if the rule does not have that key.
std::optional<std::string> valueOf(const std::string& rule, const std::string& key) {
  const std::size_t begin = rule.find(key);
  if (begin == std::string::npos) return std::nullopt;
  const std::size_t value = begin + key.size();
  const std::size_t end = rule.find('"', value);
  return end == std::string::npos ? std::nullopt : std::optional(rule.substr(value, end - value));
}

bool givesEveryoneARight(const std::string& mode) {
  return !mode.empty() && mode.back() > '0' && mode.back() <= '7';
}

bool namesAKinect(const std::string& rule) {
  const auto vendor = valueOf(rule, "{idvendor}==\"");
  if (!vendor || vendor->find(kKinectVendor) == std::string::npos) return false;
  const auto product = valueOf(rule, "{idproduct}==\"");
  return !product || std::ranges::any_of(kKinectCameras, [&](const char* id) {
    return product->find(id) != std::string::npos || product->find('*') != std::string::npos;
  });
}

/// "0003:046d:c626.", with which the name on the HID bus begins; empty if the text is not an id.
std::string busNameFrom(const std::string& id) {
  constexpr std::size_t kLength = 22;  // bus, vendor, product: 4, 8 and 8 digits
  if (id.size() != kLength) return {};
  std::string name = id.substr(0, 5) + id.substr(9, 5) + id.substr(18) + '.';
  std::ranges::transform(name, name.begin(), [](unsigned char letter) { return std::tolower(letter); });
  return name;
}

/// The files that udev reads, sorted by name. Of several with one name it reads that of the administrator,
/// else that of this boot, else that of a package. Errors: a folder of rules that cannot be read.
Reading<std::vector<RulesFile>> rulesFiles(const Machine& machine) {
  std::map<std::string, RulesFile> files;
  for (const std::string folder : kFolders) {
    const Reading<Names> names = machine.list(folder);
    if (!names && !names.error().absent()) return std::unexpected(names.error());
    for (const std::string& name : names.value_or(Names{})) {
      if (!name.ends_with(".rules") || files.contains(name)) continue;
      const Reading<std::string> content = machine.read(folder + name);
      files[name] = {name, folder + name, content && content->empty()};
    }
  }
  std::vector<RulesFile> list;
  for (auto& [name, file] : files) list.push_back(std::move(file));
  return list;
}

/// The rules of a file that name a Kinect by its ids and let everyone use it. A rule that matches it in
/// another way is not recognised.
std::vector<OpenRule> openKinectRules(const Machine& machine, const RulesFile& file) {
  std::vector<OpenRule> open;
  for (const std::string& rule : rulesIn(machine.read(file.path).value_or(""))) {
    if (!namesAKinect(rule)) continue;
    const auto final_mode = valueOf(rule, "mode:=\"");
    const auto mode = final_mode ? final_mode : valueOf(rule, "mode=\"");
    if (mode && givesEveryoneARight(*mode)) open.push_back({file.path, final_mode.has_value()});
  }
  return open;
}

/// Whether a rule of the file gives a HID device to the group hapticd by its name on the HID bus.
/// `id`: HID_ID of the device's uevent, as in "0003:0000046D:0000C626". `is_handle`: the configuration names
/// the device, which a rule may ask a program.
bool givesHidDevice(const Machine& machine, const RulesFile& file, const std::string& id, bool is_handle) {
  const std::string name = busNameFrom(id);
  return !name.empty() &&
         std::ranges::any_of(rulesIn(machine.read(file.path).value_or("")), [&](const std::string& rule) {
           const auto names = valueOf(rule, "kernels==\"");
           return names && names->find(name) != std::string::npos && valueOf(rule, "group=\"") == "hapticd" &&
                  (is_handle || !valueOf(rule, "program==\""));
         });
}

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
