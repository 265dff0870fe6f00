// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/udev_rule.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <sstream>

#include "tools/hapticctl/doctor/usb_device.h"

namespace hapticd::tools {
namespace {

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

}  // namespace

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

bool givesHidDevice(const Machine& machine, const RulesFile& file, const std::string& id, bool is_handle) {
  const std::string name = busNameFrom(id);
  return !name.empty() &&
         std::ranges::any_of(rulesIn(machine.read(file.path).value_or("")), [&](const std::string& rule) {
           const auto names = valueOf(rule, "kernels==\"");
           return names && names->find(name) != std::string::npos && valueOf(rule, "group=\"") == "hapticd" &&
                  (is_handle || !valueOf(rule, "program==\""));
         });
}

}  // namespace hapticd::tools
