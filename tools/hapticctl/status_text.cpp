// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/status_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "drivers/led/led_panel.h"
#include "rt/loop_state.h"
#include "rt/words.h"
#include "tools/client/reply_reader.h"

namespace hapticd::tools {
namespace {

/// The cause of a mode in words; empty where the mode says all.
const char* textOf(rt::Cause cause) {
  switch (cause) {
    case rt::Cause::none:
    case rt::Cause::requested:
      return "";
    case rt::Cause::no_scene:
      return "no depth frame has been modelled yet";
    case rt::Cause::depth_stale:
      return "the newest depth frame is too old";
    case rt::Cause::handle_stale:
      return "the handle has stopped measuring";
    case rt::Cause::handle_invalid:
      return "the handle's position is impossible";
    case rt::Cause::force_not_finite:
      return "the force law computed a number that is not finite";
    case rt::Cause::handle_too_fast:
      return "the hand seems to move faster than safety.max_handle_speed_m_per_s";
    case rt::Cause::handle_clutched:
      return "the clutch is held";
    case rt::Cause::handle_not_calibrated:
      return "the handle is not calibrated yet";
    case rt::Cause::handle_replaced:
      return "the handle was lost and came back; engage again when it is safe";
    case rt::Cause::outside_workspace:
      return "the handle is outside safety.workspace_radius_m";
    case rt::Cause::inside_surface:
      return "engaging was refused: the handle would be in contact at once";
    case rt::Cause::overrun_burst:
      return "too many ticks ended late";
    case rt::Cause::surface_too_near:
      return "the surface has come nearer than the camera can measure";
  }
  return "";
}

/// The same of a word in a reply; a newer daemon may know more causes.
std::string causeText(const std::string& word) {
  const std::optional<rt::Cause> cause = rt::withWord<rt::Cause>(word);
  if (cause) return textOf(*cause);
  return word == "-" ? "" : word;
}

std::string privilegesText(const Json& status) {
  const Json* cpu = fieldAt(status, "loop.cpu");
  return fmt::format("{}, {}, memory {}", cpu && cpu->is_number() ? "CPU " + valueText(*cpu) : "not pinned",
                     flagAt(status, "loop.realtimeScheduling") ? "SCHED_FIFO" : "no real-time scheduling",
                     flagAt(status, "loop.memoryLocked") ? "locked" : "not locked");
}

std::string vectorText(const Json& status, const std::string& path, int digits) {
  return fmt::format("({}, {}, {})", fixed(numberAt(status, path + ".x"), digits),
                     fixed(numberAt(status, path + ".y"), digits),
                     fixed(numberAt(status, path + ".z"), digits));
}

/// "12 overruns, 3 skipped periods" from {path, words} pairs.
using Counter = std::pair<const char*, const char*>;
std::string countersText(const Json& status, const std::string& group,
                         std::initializer_list<Counter> counters) {
  std::string text;
  for (const auto& [name, words] : counters) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", countAt(status, group + name), words);
  }
  return text;
}

std::string line(std::string_view title, const std::string& text) {
  return statusRow(title, text) + "\n";
}

std::string loopText(const Json& status) {
  return line("force loop", fixed(numberAt(status, "loop.rateHz"), 1) + " Hz, " + privilegesText(status)) +
         line("", countersText(
                      status, "loop.counters.",
                      {{"ticks", "ticks"}, {"overruns", "overruns"}, {"skippedPeriods", "skipped periods"}}) +
                      ", " + countAt(status, "loop.pageFaults") + " page faults") +
         line("wake-up", latencyText(status, "loop.wakeupLatency")) +
         line("compute", latencyText(status, "loop.computeTime"));
}

std::string forceText(const Json& status) {
  const std::string force = "tick.commandForceNInWorld";
  return line("force",
              fmt::format("{} N {}, by the law {} N, {}", fixed(lengthAt(status, force), 3),
                          vectorText(status, force, 3), fixed(lengthAt(status, "tick.lawForceNInWorld"), 3),
                          contactText(status))) +
         line("", "at " + vectorText(status, "tick.hipMInWorld", 4) + " m in the world") +
         line("", countersText(status, "loop.counters.",
                               {{"contactTicks", "ticks in contact"},
                                {"slewLimitedTicks", "slew limited"},
                                {"magnitudeClampedTicks", "clamped"},
                                {"notFiniteTicks", "not finite"}}));
}

std::string lawText(const Json& status) {
  std::string text = textAt(status, "law.chosen");
  if (flagAt(status, "law.filtered")) text += ", filtered depth";
  return line("law", text + ": " + textAt(status, "law.reason"));
}

std::string cameraText(const Json& status) {
  return line("camera",
              fmt::format("{}, {}", textAt(status, "camera.state"), textAt(status, "camera.identity"))) +
         line("", countersText(status, "camera.", {{"frames", "frames"}, {"damagedFrames", "damaged"}}));
}

std::string sceneText(const Json& status) {
  return line("scene",
              fmt::format("{} frames per second, {} points, modelled in {}, felt at an age of {}",
                          fixed(numberAt(status, "scene.frameRateHz"), 1), countAt(status, "scene.points"),
                          duration(numberAt(status, "scene.lastModelNs")),
                          duration(numberAt(status, "tick.sceneAgeNs")))) +
         line("", countersText(status, "scene.",
                               {{"frames", "frames"},
                                {"skippedFrames", "skipped"},
                                {"models", "models"},
                                {"remodels", "of them remodelled"},
                                {"pointsOverCapacity", "points over capacity"}})) +
         line("", countersText(status, "loop.counters.",
                               {{"outsideModelTicks", "ticks outside the model"},
                                {"depthStaleTicks", "with stale depth"}}));
}

/// Nothing for a handle without a measured connection.
std::string linkText(const Json& status) {
  const Json* link = fieldAt(status, "handle.link");
  if (!link || link->is_null()) return "";
  return line("link", countersText(status, "handle.link.",
                                   {{"sent", "sent"},
                                    {"received", "received"},
                                    {"lost", "lost"},
                                    {"duplicated", "twice"},
                                    {"reordered", "late"},
                                    {"rejected", "rejected"}})) +
         line("round trip", latencyText(status, "handle.link.roundTrip"));
}

/// Nothing for a handle that no command has been sent to.
std::string lastHopText(const Json& status) {
  const Json* hop = fieldAt(status, "handle.lastHop");
  if (!hop || hop->is_null()) return "";
  const double priority = numberAt(status, "handle.threadPriority");
  return line("last hop", latencyText(status, "handle.lastHop") +
                              (priority > 0 ? fmt::format(", at priority {}", fixed(priority, 0)) : ""));
}

/// What is left of the stiffness, and which rule takes the rest.
std::string stiffnessText(const Json& status) {
  const double at_hand = numberAt(status, "law.handStiffnessNPerM");
  const double gain = numberAt(status, "tick.stiffnessGain");
  const std::string damping =
      fmt::format(", {} N s/m in contact{}", fixed(numberAt(status, "tick.contactDampingNSPerM"), 2),
                  flagAt(status, "tick.handleDamps") ? " by the device" : "");
  if (!(gain > 0 && gain < 1)) return fmt::format("{} N/m at the hand{}", fixed(at_hand, 0), damping);
  const auto rule = rt::withWord<rt::StiffnessRule>(textAt(status, "tick.stiffnessRule"));
  const char* const why = rule == rt::StiffnessRule::mass    ? "mass of the device at"
                          : rule == rt::StiffnessRule::delay ? "damping of the hand at"
                                                             : "rising again after";
  return fmt::format("{} of {} N/m at the hand ({} {} ms delay){}", fixed(at_hand, 0),
                     fixed(at_hand / gain, 0), why, fixed(numberAt(status, "tick.handleDelayS") * 1e3, 1),
                     damping);
}

std::string safetyText(const Json& status) {
  return line("safety", countersText(status, "loop.counters.",
                                     {{"passivityTicks", "ticks damped for passivity"},
                                      {"thermallyLimitedTicks", "warm"},
                                      {"stiffnessLimitedTicks", "softened for delay"}}) +
                            ", " + stiffnessText(status));
}

std::string handleText(const Json& status) {
  return line("handle",
              fmt::format("{}, {}{}", textAt(status, "handle.state"), textAt(status, "handle.identity"),
                          flagAt(status, "handle.exertsForce") ? "" : ", exerts no force")) +
         line("",
              countersText(status, "handle.", {{"measurements", "measurements"}, {"rejected", "rejected"}}) +
                  ", " +
                  countersText(status, "loop.counters.",
                               {{"handleStaleTicks", "ticks stale"},
                                {"handleInvalidTicks", "ticks invalid"},
                                {"releases", "releases"}})) +
         lastHopText(status) + linkText(status);
}

/// ", 12.3 of 20.0 GB in the folder"
std::string folderText(const Json& status) {
  const double bytes = numberAt(status, "trace.folderBytes");
  const double limit = numberAt(status, "trace.folderLimitBytes");
  if (std::isnan(bytes)) return "";
  return fmt::format(", {}{} in the folder", bytesText(bytes),
                     std::isnan(limit) ? "" : " of " + bytesText(limit));
}

std::string rangeText(const Json& parameter) {
  const Json* minimum = fieldAt(parameter, "minimum");
  const Json* maximum = fieldAt(parameter, "maximum");
  if (minimum && maximum && minimum->is_number() && maximum->is_number()) {
    return fmt::format("{}..{}", valueText(*minimum), valueText(*maximum));
  }
  std::string words;
  for (const Json& choice : listAt(parameter, "choices"))
    words += (words.empty() ? "" : "|") + valueText(choice);
  if (!words.empty()) return words;
  return textAt(parameter, "kind") == "boolean" ? "true|false" : "text";
}

std::string fieldText(const Json& parameter, const char* name) {
  const Json* field = fieldAt(parameter, name);
  if (!field || field->is_null()) return "-";
  const std::string text = valueText(*field);
  return text.empty() ? "-" : text;
}

}  // namespace

std::string contactText(const Json& status) {
  const std::string points = "from " + countAt(status, "tick.pointsUsed") + " points";
  const std::string law = textAt(status, "tick.law");
  if (law != "proxy" && law != "surface") return points;
  return textAt(status, "tick.contact") + (law == "proxy" ? ", " + points : "");
}

std::string statusRow(std::string_view title, const std::string& text) {
  return fmt::format("{:<14}{}", title, text);
}

std::string modeText(const Json& status) {
  const std::string cause = causeText(textAt(status, "cause"));
  return textAt(status, "mode") + (cause.empty() ? "" : ": " + cause);
}

std::string uptimeText(double seconds) {
  if (std::isnan(seconds) || seconds < 120) return fixed(seconds, 0) + " s";
  if (seconds < 7200) return fmt::format("{:.0f} min", std::floor(seconds / 60));
  return fmt::format("{:.1f} h", seconds / 3600);
}

std::string bytesText(double bytes) {
  if (std::isnan(bytes)) return "-";
  return bytes < 1e9 ? fmt::format("{:.1f} MB", bytes / 1e6) : fmt::format("{:.1f} GB", bytes / 1e9);
}

std::string traceText(const Json& status) {
  const std::string state = textAt(status, "trace.state");
  if (state == "-") return "not known to this hapticd";
  std::string text = state;
  if (state == "writing") {
    text +=
        fmt::format(" {}, {} in {}", textAt(status, "trace.name"), bytesText(numberAt(status, "trace.bytes")),
                    uptimeText(numberAt(status, "trace.durationS")));
  } else if (state == "waiting") {
    text += ": " + textAt(status, "trace.detail");
  }
  text += fmt::format(", {} traces", countAt(status, "trace.traces"));
  text += folderText(status);
  const double free_bytes = numberAt(status, "trace.freeBytes");
  if (!std::isnan(free_bytes)) text += fmt::format(", {} free", bytesText(free_bytes));
  if (numberAt(status, "trace.ticksLost") > 0)
    text += ", " + countAt(status, "trace.ticksLost") + " ticks lost";
  return text;
}

std::string ledsText(const Json& status) {
  const std::string state = textAt(status, "leds.state");
  if (state == "none" || state == "-") return "";
  std::string patterns;
  for (const std::string_view led : rt::kWords<drivers::Led>) {
    const std::string pattern = textAt(status, fmt::format("leds.{}", led));
    if (pattern != "-") patterns += fmt::format("{}{} {}", patterns.empty() ? "" : ", ", led, pattern);
  }
  return fmt::format("{}, {}: {}", state, textAt(status, "leds.identity"), patterns);
}

std::string versionsText(const Json& status) {
  return fmt::format("hapticd {}, hapticctl {}, kernel {}", textAt(status, "version"), HAPTICD_VERSION,
                     textAt(status, "kernel"));
}

std::vector<std::string> complaints(const Json& status) {
  std::vector<std::string> lines;
  const auto add = [&](std::string line) {
    if (std::ranges::find(lines, line) == lines.end()) lines.push_back(std::move(line));
  };
  const auto withDetail = [&](std::string text, const char* path) {
    const std::string detail = textAt(status, path);
    return detail.empty() || detail == "-" ? text : text + ": " + detail;
  };
  if (textAt(status, "mode") == "faulted") {
    add("faulted: " + causeText(textAt(status, "cause")) + " (mend that, then: hapticctl clear-fault)");
  }
  if (const std::string state = textAt(status, "camera.state"); state != "streaming") {
    add(withDetail("camera " + state, "camera.detail"));
  }
  if (const std::string state = textAt(status, "handle.state"); state != "present") {
    add(withDetail("handle " + state, "handle.detail"));
  }
  if (textAt(status, "trace.state") == "waiting") add(withDetail("trace waits", "trace.detail"));
  for (const Json& warning : listAt(status, "warnings")) add(valueText(warning));
  return lines;
}

std::string statusText(const Json& status) {
  std::string text;
  for (const std::string& line : complaints(status)) text += "! " + line + "\n";
  text += line("mode", fmt::format("{}, up {}", modeText(status), uptimeText(numberAt(status, "uptimeS"))));
  text += loopText(status) + lawText(status) + forceText(status) + safetyText(status) + cameraText(status) +
          sceneText(status) + handleText(status);
  if (const std::string leds = ledsText(status); !leds.empty()) text += line("leds", leds);
  text += line("trace", traceText(status));
  text += line("", countAt(status, "loop.traceTicksDropped") + " ticks dropped");
  text += line("", countersText(status, "trace.",
                                {{"recordsLost", "records lost"}, {"depthFramesLost", "depth frames lost"}}));
  text += line("control", countersText(status, "control.",
                                       {{"connections", "connections"},
                                        {"refusedConnections", "refused"},
                                        {"ticksLost", "ticks lost"}}));
  text += line("versions", versionsText(status));
  return text;
}

std::string latencyText(const Json& status, const std::string& path) {
  const auto at = [&](const char* name) { return duration(numberAt(status, path + name)); };
  return fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", at(".p50Ns"), at(".p99Ns"), at(".p999Ns"),
                     at(".maxNs"));
}

std::string monitorLine(const Json& reply) {
  const double ticks = numberAt(reply, "window.ticks");
  const double contact = ticks > 0 ? 100 * numberAt(reply, "window.contactTicks") / ticks : std::nan("");
  return fmt::format(
      "{:>8} s  {:<9} {:>7} Hz  camera {:<9} {:>5} fps  contact {:>3} %  force {}..{} N  wake-up max {}  "
      "overruns {}  dropped {}",
      fixed(numberAt(reply, "status.uptimeS"), 1), textAt(reply, "status.mode"),
      fixed(numberAt(reply, "status.loop.rateHz"), 1), textAt(reply, "status.camera.state"),
      fixed(numberAt(reply, "status.scene.frameRateHz"), 1), fixed(contact, 0),
      fixed(numberAt(reply, "window.minForceN"), 2), fixed(numberAt(reply, "window.maxForceN"), 2),
      duration(numberAt(reply, "window.maxWakeupLatencyNs")), countAt(reply, "status.loop.counters.overruns"),
      countAt(reply, "droppedCount"));
}

std::string liveLine(const Json& reply) {
  const double ticks = numberAt(reply, "window.ticks");
  const double contact = ticks > 0 ? 100 * numberAt(reply, "window.contactTicks") / ticks : std::nan("");
  return fmt::format("{:>6} s {:>7} Hz {:>5} fps  contact {:>3} %  force {:>5} N  wake-up max {:>8}  {}",
                     fixed(numberAt(reply, "status.uptimeS"), 1),
                     fixed(numberAt(reply, "status.loop.rateHz"), 1),
                     fixed(numberAt(reply, "status.scene.frameRateHz"), 1), fixed(contact, 0),
                     fixed(numberAt(reply, "window.maxForceN"), 2),
                     duration(numberAt(reply, "window.maxWakeupLatencyNs")), textAt(reply, "status.mode"));
}

std::string withUnit(const std::string& value, const Json& parameter) {
  const std::string unit = textAt(parameter, "unit");
  return unit.empty() || unit == "-" ? value : value + " " + unit;
}

std::string parameterLine(const Json& parameter) {
  return fmt::format("{} = {}", textAt(parameter, "name"),
                     withUnit(fieldText(parameter, "value"), parameter));
}

std::string parameterTableText(const Json& parameters) {
  std::vector<std::array<std::string, 7>> rows{
      {"NAME", "VALUE", "UNIT", "ALLOWED", "DEFAULT", "EFFECT", "MEANING"}};
  for (const Json& parameter : parameters) {
    const std::string symbol = textAt(parameter, "symbol");
    const std::string paper = symbol.empty() || symbol == "-" ? "" : " [" + symbol + " of the paper]";
    rows.push_back({textAt(parameter, "name"), fieldText(parameter, "value"), fieldText(parameter, "unit"),
                    rangeText(parameter), fieldText(parameter, "default"), textAt(parameter, "effect"),
                    textAt(parameter, "help") + paper});
  }
  std::array<std::size_t, 6> widths{};
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < widths.size(); ++i) text += fmt::format("{:<{}}  ", row[i], widths[i]);
    text += row.back() + "\n";
  }
  return text;
}

}  // namespace hapticd::tools
