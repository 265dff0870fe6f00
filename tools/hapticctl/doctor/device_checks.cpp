// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
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

/// Named where any of the folders cannot be read.
constexpr const char* kRulesFolder = "usr/lib/udev/rules.d";

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
    if (!names && !names.error().absent())
      return std::unexpected(Unread{names.error().system_error, kRulesFolder});
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

}  // namespace

Findings checkUdevRules(const Examination& box) {
  const Reading<std::vector<RulesFile>> files = rulesFiles(box.machine);
  if (!files) return files.error();
  const auto own = std::ranges::find(*files, kOwnRules, &RulesFile::name);
  if (own == files->end()) {
    return failureOfTheService(box, fmt::format("{} is not installed", kOwnRules),
                               "install hapticd's package: without its rules no device belongs to hapticd");
  }
  if (own->masked) {
    return failureOfTheService(
        box, fmt::format("/{} switches hapticd's rules off", own->path),
        fmt::format("rm /{}, then udevadm control --reload && udevadm trigger", own->path));
  }
  return good("/" + own->path);
}

Findings checkOtherRules(const Examination& box) {
  const Reading<std::vector<RulesFile>> files = rulesFiles(box.machine);
  if (!files) return files.error();
  Findings findings;
  for (const RulesFile& file : *files) {
    if (file.name == kOwnRules) continue;
    for (const OpenRule& rule : openKinectRules(box.machine, file)) {
      // our rule overrides an earlier one, unless that is final
      if (file.name < kOwnRules && !rule.final) continue;
      findings.push_back(
          warning(fmt::format("/{} lets everyone use a Kinect, and overrides hapticd's", rule.file),
                  fmt::format("ln -s /dev/null /etc/udev/rules.d/{}, then udevadm control --reload "
                              "&& udevadm trigger",
                              file.name)));
      break;
    }
  }
  return findings.orElse(good("none lets everyone use a Kinect"));
}

/// The HID devices that a udev rule gives to the group hapticd: only these rules determine which devices
/// are handles.
Findings checkHid(const Examination& box) {
  const Reading<Names> names = box.machine.list("sys/class/hidraw");
  if (!names && !names.error().absent()) return names.error();
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
    findings.add(
        accessFindings(box, device, "dev/" + name).orElse(good(fmt::format("{} at /dev/{}", device, name))));
  }
  return findings.orElse(good("no handle that udev gives to hapticd is on hidraw"));
}

namespace {

constexpr const char* kChipPrefix = "gpiochip";

struct Chip {
  std::string name;  ///< "gpiochip0"
  std::expected<std::string, int> label;
};

std::string textOf(const Chip& chip) {
  return chip.label ? fmt::format("{} ({})", chip.name, *chip.label) : chip.name;
}

std::vector<std::string> textsOf(const std::vector<Chip>& chips) {
  std::vector<std::string> texts;
  for (const Chip& chip : chips) texts.push_back(textOf(chip));
  return texts;
}

/// Links are left out: some kernels make one for a number that a chip had before.
Reading<std::vector<Chip>> chipsOf(const Examination& box) {
  const Reading<Names> names = box.machine.list("dev");
  if (!names) return std::unexpected(names.error());
  std::vector<Chip> chips;
  for (const std::string& name : *names) {
    if (!name.starts_with(kChipPrefix) || !box.machine.linkedName("dev/" + name).empty()) continue;
    const auto label = box.gpio_label ? box.gpio_label("/dev/" + name) : std::unexpected(ENOTSUP);
    chips.push_back({name, label});
  }
  return chips;
}

/// The chip that leds.chip names: by path, name or label, as the driver takes it.
Finding configuredChip(const Examination& box, const std::vector<Chip>& chips) {
  const std::string& wanted = box.configuration.settings.leds.chip;
  const std::string path = wanted.starts_with('/') ? wanted.substr(1) : "dev/" + wanted;
  const bool names_a_file = wanted.starts_with('/') || wanted.starts_with(kChipPrefix);
  if (names_a_file && box.machine.exists(path)) {
    const auto chip =
        std::ranges::find(chips, std::filesystem::path(wanted).filename().string(), &Chip::name);
    return good(fmt::format("leds.chip is {}", chip == chips.end() ? wanted : textOf(*chip)));
  }
  for (const Chip& chip : chips) {
    if (chip.label && *chip.label == wanted) return good(fmt::format("leds.chip is {}", textOf(chip)));
  }
  const auto unread = std::ranges::find_if(chips, [](const Chip& chip) { return !chip.label; });
  if (!names_a_file && unread != chips.end()) {
    return warning(
        fmt::format("whether a chip has the label leds.chip = {} is not known: the label of {} cannot be "
                    "read ({})",
                    wanted, unread->name, std::generic_category().message(unread->label.error())),
        "run as root");
  }
  const std::string fact = fmt::format("there is no chip leds.chip = {}", wanted);
  if (chips.empty()) {
    return warning(fact + ", nor another one", "load the driver of the chip, or set leds.driver: none");
  }
  return warning(
      fmt::format("{}; there are {}", fact, someOf(textsOf(chips), 12)),
      "below 'leds:' in /etc/hapticd/hapticd.yaml set 'chip:' to the label of one of them, which no kernel "
      "renumbers, then systemctl restart hapticd");
}

}  // namespace

/// Of other chips hapticd has no need, and the udev rules do not give them to it.
Findings checkGpio(const Examination& box) {
  if (box.configuration.settings.leds.driver != config::LedDriver::gpiod)
    return good("no LEDs are configured, so no chip is needed");
  const Reading<std::vector<Chip>> chips = chipsOf(box);
  if (!chips) return chips.error();
  Findings findings{configuredChip(box, *chips)};
  const auto used =
      std::ranges::find_if(*chips, [&](const Chip& chip) { return isChipOfLeds(box, chip.name); });
  if (used == chips->end()) return findings;
  for (Finding& finding : accessFindings(box, textOf(*used), "dev/" + used->name)) {
    // a box works without LEDs
    if (finding.verdict == Verdict::fail) finding.verdict = Verdict::warn;
    findings.push_back(std::move(finding));
  }
  return findings;
}

}  // namespace hapticd::tools
