// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/findings.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

std::string_view verdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::warn:
      return "warn";
    case Verdict::fail:
      return "fail";
  }
  return "?";
}

int exitStatus(const Findings& findings) {
  return std::ranges::count(findings, Verdict::fail, &Finding::verdict) > 0 ? 1 : 0;
}

std::string textOf(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += fmt::format("{:<4}  {}: {}", verdictText(finding.verdict), finding.name, printable(finding.fact));
    if (!finding.remedy.empty()) text += fmt::format(" ({})", printable(finding.remedy));
    text += '\n';
  }
  return text;
}

std::string jsonOf(const Findings& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"name", finding.name},
                    {"verdict", verdictText(finding.verdict)},
                    {"fact", finding.fact},
                    {"remedy", finding.remedy}});
  }
  return list.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

namespace {

constexpr const char* kTriggerRules = "udevadm control --reload && udevadm trigger --action=change";

bool isReadableAndWritable(mode_t mode, mode_t read, mode_t write) {
  return (mode & read) != 0 && (mode & write) != 0;
}

}  // namespace

Findings findingsOfInUse(const std::string& name, const DeviceInUse& device) {
  if (device.state.empty()) return {};
  const std::string fact = fmt::format("hapticd uses {}: {}", device.identity, device.state);
  if (device.works) return {good(name, fact)};
  return {warning(name, fact, device.detail.empty() ? "hapticctl status shows its state" : device.detail)};
}

Finding good(std::string name, std::string fact) {
  return {Verdict::ok, std::move(name), std::move(fact), ""};
}

Finding warning(std::string name, std::string fact, std::string remedy) {
  return {Verdict::warn, std::move(name), std::move(fact), std::move(remedy)};
}

Finding failure(std::string name, std::string fact, std::string remedy) {
  return {Verdict::fail, std::move(name), std::move(fact), std::move(remedy)};
}

Finding failureOfTheService(const Examination& box, std::string name, std::string fact, std::string remedy) {
  const Verdict verdict = isInstalled(box.unit) ? Verdict::fail : Verdict::warn;
  return {verdict, std::move(name), std::move(fact), std::move(remedy)};
}

Finding unreadable(std::string name, const std::string& path, Unread why) {
  if (why.denied()) {
    return warning(std::move(name), fmt::format("/{} cannot be read as this user", path), "run as root");
  }
  if (why.absent()) {
    return warning(std::move(name), fmt::format("there is no /{}, so it is not known", path), "");
  }
  return warning(std::move(name),
                 fmt::format("/{} cannot be read: {}", path, std::strerror(why.system_error)), "");
}

std::string someOf(const std::vector<std::string>& words, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < words.size() && i < most; ++i) text += (i == 0 ? "" : ", ") + words[i];
  return words.size() <= most ? text : fmt::format("{} and {} more", text, words.size() - most);
}

Findings accessFindings(const Examination& box, const std::string& name, const std::string& device,
                        const std::string& path) {
  const Reading<Access> access = box.machine.access(path);
  if (!access) return {unreadable(name, path, access.error())};
  const mode_t mode = access->mode;
  const std::string fact = fmt::format("{}: /{} has mode {:04o}", device, path, mode);
  if ((mode & (S_IROTH | S_IWOTH)) != 0) {
    return {warning(name, fact + ", so that others than hapticd may use it",
                    fmt::format("see the findings on udev rules, then {}", kTriggerRules))};
  }
  const auto group = box.machine.group(kDeviceGroup);
  if (!group) return {unreadable(name, "etc/group", group.error())};
  const bool is_own =
      group->has_value() && (*group)->id == access->group && isReadableAndWritable(mode, S_IRGRP, S_IWGRP);
  const bool usable =
      is_own || (group->has_value() &&
                 std::ranges::find(access->more_groups, gid_t{(*group)->id}) != access->more_groups.end());
  if (usable) return {};
  return {failureOfTheService(box, name, fact + ", which keeps the group hapticd out",
                              fmt::format("{}; hapticd's rules give it to the group", kTriggerRules))};
}

}  // namespace hapticd::tools
