// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/glance_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/hapticctl/text/addition_text.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/hapticctl/text/time_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kMinColumns = 40;
/// Warnings take at most this many rows of a screen, so that there is room for the state below them.
constexpr std::size_t kWarningRows = 8;

Colour colourOfMode(const Json& status) {
  const std::string mode = textAt(status, "mode");
  if (mode == "faulted") return Colour::red;
  if (mode == "holding" || mode == "starting") return Colour::yellow;
  if (mode != "engaged") return Colour::plain;
  return warningsOf(status).empty() ? Colour::green : Colour::yellow;
}

void addLinesOf(std::vector<std::string>& lines, const std::string& text) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
}

/// The warnings, wrapped; those that take too much of the screen are only counted.
std::vector<std::string> warningLines(const Json& status, std::size_t columns, std::size_t most_rows) {
  std::vector<std::string> lines;
  const std::vector<std::string> all = warningsOf(status);
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<std::string> own;
    addLinesOf(own, wrapped("! " + all[i], columns, "  "));
    const bool last = i + 1 == all.size();
    if (lines.size() + own.size() > most_rows - (last ? 0 : 1)) {
      lines.push_back(fmt::format("! and {} more: hapticctl status --all", all.size() - i));
      break;
    }
    lines.insert(lines.end(), own.begin(), own.end());
  }
  return lines;
}

std::string loopRow(const Json& status) {
  return statusRow(
      "force loop",
      fmt::format("{} Hz, {} ticks, {} overruns, {}{}", fixed(numberAt(status, "loop.rateHz"), 1),
                  countAt(status, "loop.counters.ticks"), countAt(status, "loop.counters.overruns"),
                  flagAt(status, "loop.realtimeScheduling") ? "SCHED_FIFO" : "no real time",
                  flagAt(status, "loop.memoryLocked") ? ", locked" : ""));
}

std::string forceRow(const Json& status) {
  return statusRow("force",
                   fmt::format("{} N, by the law {} N, {}, stable to {} N/m",
                               fixed(lengthAt(status, "tick.commandForceNInWorld"), 2),
                               fixed(lengthAt(status, "tick.lawForceNInWorld"), 2), contactText(status),
                               fixed(numberAt(status, "tick.stiffnessLimitNPerM"), 0)));
}

std::string hipRow(const Json& status) {
  const auto at = [&](const char* axis) {
    return fixed(numberAt(status, std::string("tick.hipMInWorld.") + axis), 3);
  };
  return statusRow("HIP", fmt::format("({}, {}, {}) m in the world", at("x"), at("y"), at("z")));
}

std::string cameraRow(const Json& status) {
  return statusRow(
      "camera", fmt::format("{}, {} fps, {} frames, {} damaged, {}", textAt(status, "camera.state"),
                            fixed(numberAt(status, "scene.frameRateHz"), 1), countAt(status, "camera.frames"),
                            countAt(status, "camera.damagedFrames"), textAt(status, "camera.identity")));
}

std::string sceneRow(const Json& status) {
  return statusRow("scene",
                   fmt::format("{}, modelled in {}, in use at an age of {}", sceneContentText(status),
                               duration(numberAt(status, "scene.lastModelNs")),
                               duration(numberAt(status, "tick.sceneAgeNs"))));
}

std::string handleRow(const Json& status) {
  return statusRow("handle",
                   fmt::format("{}{}, {} measurements, {}", textAt(status, "handle.state"),
                               flagAt(status, "handle.exertsForce") ? "" : " without force",
                               countAt(status, "handle.measurements"), textAt(status, "handle.identity")));
}

/// The rows below the one of the force loop, the most important first.
std::vector<std::string> rows(const Json& status) {
  std::vector<std::string> lines{
      statusRow("wake-up", latencyText(status, "loop.wakeupLatency")),
      forceRow(status),
      cameraRow(status),
      handleRow(status),
      statusRow("trace", traceText(status)),
      sceneRow(status),
      statusRow("law", textAt(status, "law.chosen") + ": " + textAt(status, "law.reason")),
      statusRow("compute", latencyText(status, "loop.computeTime")),
      hipRow(status),
      statusRow("versions", versionsText(status))};
  const auto insertBelowForce = [&](const char* title, const std::string& text) {
    if (!text.empty()) lines.insert(lines.begin() + 2, statusRow(title, text));
  };
  if (textAt(status, "tick.stiffnessBound") != "configured")
    insertBelowForce("stiffness", surfaceStiffnessText(status));
  insertBelowForce("tissue", tissueText(status));
  insertBelowForce("fixtures", fixturesText(status));
  if (const std::string leds = ledsText(status); !leds.empty()) lines.push_back(statusRow("leds", leds));
  const Json* link = fieldAt(status, "handle.link");
  if (link && link->is_object())
    lines.push_back(statusRow("round trip", latencyText(status, "handle.link.roundTrip")));
  return lines;
}

}  // namespace

std::vector<std::string> glanceLines(const Json& status, const GlanceStyle& style) {
  const std::size_t columns = std::max(style.size.columns, kMinColumns);
  std::vector<std::string> lines;
  const bool has_limit = style.size.rows != TerminalSize::kNoLimit;
  for (const std::string& line :
       warningLines(status, columns, has_limit ? kWarningRows : TerminalSize::kNoLimit)) {
    lines.push_back(painted(line, Colour::red, style.colours));
  }
  const std::string mode =
      statusRow("mode", fmt::format("{}, up {}", modeText(status), ageText(numberAt(status, "uptimeS"))));
  lines.push_back(painted(cutTo(mode, columns), colourOfMode(status), style.colours));
  lines.push_back(cutTo(loopRow(status), columns));
  for (const std::string& line : rows(status)) lines.push_back(cutTo(line, columns));
  const std::size_t most = std::max<std::size_t>(style.size.rows, 2) - 1;
  if (lines.size() > most) lines.resize(most);
  return lines;
}

}  // namespace hapticd::tools
