// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/flood_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "tools/haptic-soak/flood.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kBetweenDisengages{100};
constexpr std::chrono::seconds kPatienceWithHapticctl{30};

double secondsBehind(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Engages, so that there is something to end, then times hapticctl.
void disengageOnce(const DaemonProcess& daemon, const FloodOptions& options, FloodResult& result) {
  if (auto client = VarlinkClient::connect(daemon.controlSocket())) {
    (void)client->call("io.hapticd.Control.Engage", {{"insideSurface", true}});
  }
  const auto begin = Clock::now();
  auto child = ChildProcess::start(
      {options.soak.hapticctl.string(), "--socket", daemon.controlSocket(), "disengage"}, {}, "");
  const auto ending = child ? child->waitFor(kPatienceWithHapticctl) : std::nullopt;
  result.disengage_s.push_back(secondsBehind(begin));
  if (!ending || !ending->good()) ++result.failed;
}

void readStatus(const DaemonProcess& daemon, FloodResult& result) {
  auto client = VarlinkClient::connect(daemon.controlSocket());
  auto reply = client ? client->call("io.hapticd.Status.GetStatus") : std::unexpected(client.error());
  if (reply) {
    result.status = (*reply)["status"];
  } else {
    result.status_error = reply.error().what;
  }
}

std::optional<double> ifKnown(double value) {
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

std::optional<double> middleOf(std::vector<double> times) {
  if (times.empty()) return std::nullopt;
  std::ranges::sort(times);
  return times[times.size() / 2];
}

std::optional<double> longest(const std::vector<double>& times) {
  return times.empty() ? std::nullopt : std::optional(std::ranges::max(times));
}

std::string shown(const std::optional<double>& value) {
  return value ? fmt::format("{:.4g}", *value) : "-";
}

}  // namespace

config::Result<FloodResult> studyFlood(const FloodOptions& options, const Interrupt& interrupt,
                                       const std::function<void(double)>& progress) {
  const ScratchFolder folder;
  auto daemon =
      DaemonProcess::start(folder, options.soak.daemon, options.soak.config_file, options.soak.assignments);
  if (!daemon) return std::unexpected(daemon.error());
  std::error_code ignored;
  fs::permissions(folder.path(), fs::perms(0711), ignored);  // for another user to connect
  FloodResult result;
  const auto begin = Clock::now();
  {
    const Flood flood(daemon->statusSocket(), options.connections);
    while (!interrupt.requested() && daemon->running() && secondsBehind(begin) < options.soak.seconds) {
      disengageOnce(*daemon, options, result);
      progress(secondsBehind(begin));
      std::this_thread::sleep_for(kBetweenDisengages);
    }
    result.flooded = flood.isRunning();
    readStatus(*daemon, result);
  }
  return result;
}

std::vector<SoakFinding> findingsOf(const FloodResult& result, const FloodOptions& options) {
  const double gap_ns = numberAt(result.status, "control.longestGapNs");
  return {{"longest wait of the watchdog, s", ifKnown(gap_ns * 1e-9), options.max_gap_s},
          {"longest hapticctl disengage, s", longest(result.disengage_s), options.max_disengage_s},
          {"median of hapticctl disengage, s", middleOf(result.disengage_s), {}},
          {"hapticctl disengage that failed", static_cast<double>(result.failed), 0},
          {"ticks lost between the loop and the trace",
           ifKnown(numberAt(result.status, "loop.traceTicksDropped")), 0},
          {"ticks lost because the control thread was too slow",
           ifKnown(numberAt(result.status, "control.ticksLost")), 0},
          {"floods that ended early", result.flooded ? 0.0 : 1.0, 0},
          {"connections refused", ifKnown(numberAt(result.status, "control.refusedConnections")), {}}};
}

std::string floodTable(const FloodResult& result, const std::vector<SoakFinding>& findings) {
  std::string text = fmt::format("  {} ticks, {} times disengaged\n\n  {:<56}{:>12}{:>10}\n",
                                 countAt(result.status, "loop.counters.ticks"), result.disengage_s.size(),
                                 "under the flood", "", "at most");
  for (const SoakFinding& finding : findings) {
    text += fmt::format("  {:<56}{:>12}{:>10}{}\n", finding.what, shown(finding.value), shown(finding.limit),
                        finding.broken() ? "  BROKEN" : "");
  }
  if (!result.status_error.empty())
    text += fmt::format("\nno status at the end: {}\n", printable(result.status_error));
  return text;
}

std::string floodJson(const FloodResult& result, const std::vector<SoakFinding>& findings) {
  Json document = {
      {"findings", Json::array()}, {"disengageS", result.disengage_s}, {"status", result.status}};
  for (const SoakFinding& finding : findings) {
    document["findings"].push_back({{"what", finding.what},
                                    {"value", finding.value ? Json(*finding.value) : Json()},
                                    {"limit", finding.limit ? Json(*finding.limit) : Json()},
                                    {"broken", finding.broken()}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
