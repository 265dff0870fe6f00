// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "traces";

/// The folder of the traces, without the leading slash.
std::string stateFolder(const Examination& box) {
  const std::string& folder = box.configuration.settings.state.folder;
  return folder.starts_with('/') ? folder.substr(1) : folder;
}

Finding rightFinding(const Examination& box, const std::string& folder, const Access& access) {
  const auto user = box.machine.user(kDeviceGroup);
  if (!user) return unreadable(kName, "etc/passwd", user.error());
  const bool own = user->has_value() && (*user)->id == access.owner && (access.mode & S_IWUSR) != 0;
  if (own) return good(kName, fmt::format("hapticd may write to /{}", folder));
  return failureOfTheService(box, kName, fmt::format("the user hapticd may not write to /{}", folder),
                             fmt::format("chown -R hapticd:hapticd /{0} && chmod u+rwx /{0}", folder));
}

Finding spaceFinding(const Examination& box, const std::string& folder) {
  const Reading<std::uint64_t> free_bytes = box.machine.freeBytes(folder);
  if (!free_bytes) return unreadable("trace space", folder, free_bytes.error());
  const double free_mb = static_cast<double>(*free_bytes) / 1e6;
  const double least_mb = box.configuration.settings.trace.min_free_mb;
  const std::string fact = fmt::format("{:.0f} MB free at /{}", free_mb, folder);
  if (free_mb >= least_mb) return good("trace space", fact);
  return warning("trace space",
                 fmt::format("{}, less than trace.min_free_mb = {:.0f}: no trace is written", fact, least_mb),
                 "hapticctl trace list, then hapticctl trace delete NAME, or free space otherwise");
}

}  // namespace

Findings checkTraces(const Examination& box) {
  const std::string state = stateFolder(box);
  const std::string traces = state + "/traces";
  const Reading<Access> of_state = box.machine.access(state);
  if (!of_state && of_state.error().absent()) {
    return {warning(kName, fmt::format("there is no /{} yet", state),
                    "the service creates it at its first start")};
  }
  if (!of_state) return {unreadable(kName, state, of_state.error())};
  const Reading<Access> of_traces = box.machine.access(traces);
  Findings findings;
  if (of_traces) {
    findings.push_back(rightFinding(box, traces, *of_traces));
  } else if (of_traces.error().absent()) {
    findings.push_back(rightFinding(box, state, *of_state));
  } else {
    findings.push_back(unreadable(kName, traces, of_traces.error()));
  }
  findings.push_back(spaceFinding(box, state));
  return findings;
}

Findings checkGnuplot(const Examination& box) {
  static constexpr std::array kPlaces{"usr/bin/gnuplot", "usr/local/bin/gnuplot"};
  const auto found =
      std::ranges::find_if(kPlaces, [&](const char* place) { return box.machine.exists(place); });
  if (found != kPlaces.end()) return {good("gnuplot", fmt::format("/{}", *found))};
  return {warning("gnuplot", "not installed: hapticctl trace plot cannot draw", "apt install gnuplot-nox")};
}

}  // namespace hapticd::tools
