// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

std::string property(const UnitProperties& unit, const std::string& name) {
  const auto found = unit.find(name);
  return found == unit.end() ? "" : found->second;
}

Finding stateFinding(const UnitProperties& unit) {
  const std::string active = property(unit, "ActiveState");
  const std::string fact = fmt::format("{} ({})", active, property(unit, "SubState"));
  if (active == "active" || active == "reloading") return good("service", fact);
  if (active == "failed") {
    return failure("service", fact, "journalctl -u hapticd -n 50 shows why; then systemctl restart hapticd");
  }
  return warning("service", fact, "systemctl start hapticd");
}

}  // namespace

Findings checkService(const Examination& box) {
  if (!box.unit) {
    return {warning("service", "systemd cannot be queried", "run hapticctl doctor on the box itself")};
  }
  if (!isInstalled(box.unit)) {
    const std::string state = property(*box.unit, "LoadState");
    return {warning("service", fmt::format("hapticd.service is {}", state.empty() ? "not known" : state),
                    state == "masked" ? "systemctl unmask hapticd" : "install hapticd's package")};
  }
  Findings findings{stateFinding(*box.unit)};
  const std::string enabled = property(*box.unit, "UnitFileState");
  if (enabled != "enabled" && enabled != "enabled-runtime") {
    findings.push_back(
        warning("service at boot", enabled.empty() ? "not known" : enabled,
                "systemctl enable hapticd.service hapticd-status.socket hapticd-control.socket"));
  }
  const std::string restarts = property(*box.unit, "NRestarts");
  if (!restarts.empty() && restarts != "0") {
    findings.push_back(warning("service restarts", restarts + " after failures since it was started",
                               "journalctl -u hapticd shows why"));
  }
  return findings;
}

Findings checkDaemon(const Examination& box) {
  if (!box.daemon.answers) {
    return {warning("daemon", "does not respond: " + box.daemon.problem, "systemctl start hapticd")};
  }
  Findings findings;
  for (const std::string& text : box.daemon.warnings) findings.push_back(warning("daemon", text, ""));
  if (findings.empty()) findings.push_back(good("daemon", "responds, without warnings"));
  return findings;
}

}  // namespace hapticd::tools
