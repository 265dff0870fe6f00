// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "rt/base/parameters.h"
#include "tools/hapticctl/doctor/checks.h"

namespace hapticd::tools {
namespace {

/// The limits of a unit or a user.
struct Limits {
  std::string whose;
  std::uint64_t rtprio = 0;
  std::uint64_t memlock_bytes = 0;
};

/// A limit as systemctl shows it; 0 if it does not show it.
std::uint64_t limitIn(const UnitProperties& unit, const std::string& name) {
  const auto property = unit.find(name);
  if (property == unit.end()) return 0;
  if (property->second == "infinity") return kNoLimit;
  std::uint64_t value = 0;
  std::from_chars(property->second.data(), property->second.data() + property->second.size(), value);
  return value;
}

std::string limitText(const Limits& limits) {
  const std::string memory =
      limits.memlock_bytes == kNoLimit ? "all memory" : fmt::format("{} KiB", limits.memlock_bytes / 1024);
  return fmt::format("{} may take real-time priority {} and lock {}", limits.whose, limits.rtprio, memory);
}

bool suffice(const Limits& limits) {
  return limits.rtprio >= static_cast<std::uint64_t>(rt::LoopParameters().priority) &&
         limits.memlock_bytes == kNoLimit;
}

Findings checkServiceLimits(const UnitProperties& unit) {
  const Limits limits{"hapticd.service", limitIn(unit, "LimitRTPRIO"), limitIn(unit, "LimitMEMLOCK")};
  if (suffice(limits)) return good(limitText(limits));
  return failure(
      limitText(limits),
      fmt::format(
          "[Service] LimitRTPRIO={} LimitMEMLOCK=infinity, a line each, by systemctl edit hapticd; then "
          "systemctl restart hapticd",
          rt::LoopParameters().priority));
}

Findings checkCallersLimits(const Caller& caller) {
  if (caller.user == 0) return good("root may take any priority and lock all memory");
  const Limits limits{caller.name, caller.rtprio, caller.memlock_bytes};
  const std::string note = "; hapticd.service is not known here";
  if (suffice(limits)) return good(limitText(limits) + note);
  return warning(limitText(limits) + note,
                 fmt::format("'{0} - rtprio {1}' and '{0} - memlock unlimited', a line each in "
                             "/etc/security/limits.d/hapticd.conf, then log in again",
                             caller.name, rt::LoopParameters().priority));
}

}  // namespace

Findings checkLimits(const Examination& box) {
  return isInstalled(box.unit) ? checkServiceLimits(*box.unit) : checkCallersLimits(box.caller);
}

Findings checkAccounts(const Examination& box) {
  std::vector<std::string> missing;
  for (const char* name : {kControlGroup, kDeviceGroup}) {
    const auto group = box.machine.group(name);
    if (!group) return group.error();
    if (!group->has_value()) missing.push_back(fmt::format("group {}", name));
  }
  const auto user = box.machine.user(kDeviceGroup);
  if (!user) return user.error();
  if (!user->has_value()) missing.push_back("user hapticd");
  if (missing.empty()) return good("user hapticd, groups hapticd and haptic");
  return failureOfTheService(box, "there is no " + someOf(missing),
                             "systemd-sysusers hapticd.conf, with hapticd's package installed");
}

Findings checkCaller(const Examination& box) {
  const Caller& caller = box.caller;
  if (caller.user == 0) return good("root may control the box");
  const auto group = box.machine.group(kControlGroup);
  if (!group) return group.error();
  const bool member =
      group->has_value() && std::ranges::find(caller.groups, (*group)->id) != caller.groups.end();
  if (member) return good(fmt::format("{} is in the group haptic and may control the box", caller.name));
  return warning(
      fmt::format("{} is not in the group haptic: may read the status, but not control the box", caller.name),
      fmt::format("usermod -aG haptic {}, then log in again", caller.name));
}

namespace {

std::string property(const UnitProperties& unit, const std::string& name) {
  const auto found = unit.find(name);
  return found == unit.end() ? "" : found->second;
}

Finding stateFinding(const UnitProperties& unit) {
  const std::string active = property(unit, "ActiveState");
  const std::string fact = fmt::format("{} ({})", active, property(unit, "SubState"));
  if (active == "active" || active == "reloading") return good(fact);
  if (active == "failed") {
    return failure(fact, "journalctl -u hapticd -n 50 shows why; then systemctl restart hapticd");
  }
  return warning(fact, "systemctl start hapticd");
}

}  // namespace

constexpr const char* kByHand = "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml";

Findings checkService(const Examination& box) {
  if (!box.unit && runsByHand(box)) {
    return good("systemd cannot be queried here; the hapticd that responds was started by hand");
  }
  if (!box.unit) {
    return warning("systemd cannot be queried here", fmt::format("start hapticd by hand: {}", kByHand));
  }
  if (!isInstalled(box.unit)) {
    const std::string state = property(*box.unit, "LoadState");
    return warning(fmt::format("hapticd.service is {}", state.empty() ? "not known" : state),
                   state == "masked" ? "systemctl unmask hapticd" : "install hapticd's package");
  }
  Findings findings{stateFinding(*box.unit)};
  const std::string enabled = property(*box.unit, "UnitFileState");
  if (enabled != "enabled" && enabled != "enabled-runtime") {
    findings.add(
        named("service at boot",
              warning(enabled.empty() ? "not known" : enabled,
                      "systemctl enable hapticd.service hapticd-status.socket hapticd-control.socket")));
  }
  const std::string restarts = property(*box.unit, "NRestarts");
  if (!restarts.empty() && restarts != "0") {
    findings.add(named("service restarts", warning(restarts + " after failures since it was started",
                                                   "journalctl -u hapticd shows why")));
  }
  return findings;
}

Findings checkConfiguration(const Examination& box) {
  const Configuration& configuration = box.configuration;
  if (configuration.problem.empty()) return good(configuration.source);
  return failureOfTheService(box, "cannot be used: " + configuration.problem,
                             "/usr/libexec/hapticd/hapticd --config /etc/hapticd/hapticd.yaml --check");
}

Findings checkDaemon(const Examination& box) {
  if (!box.daemon.answers) {
    return warning("does not respond: " + box.daemon.problem, !box.daemon.remedy.empty() ? box.daemon.remedy
                                                              : box.unit ? "systemctl start hapticd"
                                                                         : kByHand);
  }
  Findings findings;
  for (const std::string& text : box.daemon.warnings) findings.push_back(warning(text, ""));
  return findings.orElse(good("responds, without warnings"));
}

}  // namespace hapticd::tools
