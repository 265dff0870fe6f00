// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/box/box_diagnostics.h"

#include <fmt/format.h>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

using Level = Diagnostic::Level;

/// The text at `path`; empty if there is none.
std::string optionalText(const Json& status, const char* path) {
  const Json* const text = fieldAt(status, path);
  return text != nullptr && text->is_string() ? printable(text->get<std::string>()) : std::string();
}

Diagnostic boxOf(const Json& status) {
  const std::string mode = textAt(status, "mode");
  Diagnostic box{Level::ok, "box", fmt::format("{} ({})", mode, textAt(status, "cause")), "", {}};
  for (const Json& warning : listAt(status, "warnings")) {
    if (warning.is_string()) box.message += "; " + printable(warning.get<std::string>());
    box.level = Level::warning;
  }
  if (mode == "faulted") box.level = Level::error;
  box.values = {{"mode", mode},
                {"cause", textAt(status, "cause")},
                {"version", textAt(status, "version")},
                {"uptime_s", fixed(numberAt(status, "uptimeS"), 0)}};
  return box;
}

Diagnostic loopOf(const Json& status) {
  const std::string rate = fixed(numberAt(status, "loop.rateHz"), 1);
  return {Level::ok,
          "force loop",
          rate + " ticks per second",
          "",
          {{"rate_hz", rate},
           {"overruns", countAt(status, "loop.counters.overruns")},
           {"wakeup_latency_p99_ns", countAt(status, "loop.wakeupLatency.p99Ns")},
           {"compute_time_p99_ns", countAt(status, "loop.computeTime.p99Ns")}}};
}

/// A device with its state; `good` and `passing`: the words for one that works and one that will.
Diagnostic deviceOf(const Json& status, const std::string& device, std::string_view good,
                    std::string_view passing) {
  const std::string state = textAt(status, device + ".state");
  const std::string detail = optionalText(status, (device + ".detail").c_str());
  const std::string advice = optionalText(status, (device + ".advice").c_str());
  const bool works = state == good;
  Diagnostic part{Level::error, device, state, optionalText(status, (device + ".identity").c_str()), {}};
  if (state == passing) part.level = Level::warning;
  if (works) part.level = advice.empty() ? Level::ok : Level::warning;
  for (const std::string& more : {detail, advice}) {
    if (!more.empty()) part.message += ": " + more;
  }
  return part;
}

Diagnostic bridgeOf(const BridgeCounters& counters) {
  return {Level::ok,
          "hapticd-ros",
          fmt::format("{} messages", counters.messages),
          "",
          {{"messages", std::to_string(counters.messages)},
           {"messages_failed", std::to_string(counters.messages_failed)},
           {"ticks_lost", std::to_string(counters.ticks_lost)},
           {"ticks_late", std::to_string(counters.ticks_late)}}};
}

}  // namespace

std::vector<Diagnostic> diagnosticsOf(const Json& status, const std::string& problem,
                                      const BridgeCounters& counters, const std::string& name_space) {
  std::vector<Diagnostic> parts;
  if (status.is_null()) {
    parts.push_back({Level::stale, "box", "hapticd does not answer: " + problem, "", {}});
  } else {
    parts = {boxOf(status), loopOf(status), deviceOf(status, "camera", "streaming", ""),
             deviceOf(status, "handle", "present", "calibrating")};
    parts[2].values = {{"frames", countAt(status, "camera.frames")}};
    parts[3].values = {{"measurements", countAt(status, "handle.measurements")}};
  }
  parts.push_back(bridgeOf(counters));
  for (Diagnostic& part : parts) part.name = name_space + ": " + part.name;
  return parts;
}

}  // namespace hapticd::tools::ros
