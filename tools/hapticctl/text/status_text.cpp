// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/status_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "config/base/counted.h"
#include "config/settings/cause_text.h"
#include "drivers/led/led_panel.h"
#include "rt/base/words.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// The text of a cause's word in a reply; a newer daemon may know more modes and causes.
std::string causeText(const std::string& mode_word, const std::string& word) {
  const std::optional<rt::Cause> cause = rt::withWord<rt::Cause>(word);
  if (cause) return config::textOf(rt::withWord<rt::Mode>(mode_word).value_or(rt::Mode::starting), *cause);
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

/// A counter of the status and what it counts, as counted() takes it.
using Counter = std::pair<const char*, const char*>;
/// "12 overruns, 3 skipped periods".
std::string countersText(const Json& status, const std::string& group,
                         std::initializer_list<Counter> counters) {
  std::string text;
  for (const auto& [name, words] : counters) {
    text += (text.empty() ? "" : ", ") + base::counted(countAt(status, group + name), words);
  }
  return text;
}

std::string line(std::string_view title, const std::string& text) {
  return statusRow(title, text) + "\n";
}

std::string loopText(const Json& status) {
  return line("force loop", fixed(numberAt(status, "loop.rateHz"), 1) + " Hz, " + privilegesText(status)) +
         line("", countersText(status, "loop.counters.",
                               {{"ticks", "tick(s)"},
                                {"overruns", "overrun(s)"},
                                {"skippedPeriods", "skipped period(s)"}}) +
                      ", " + base::counted(countAt(status, "loop.pageFaults"), "page fault(s)")) +
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
                               {{"contactTicks", "tick(s) in contact"},
                                {"slewLimitedTicks", "slew limited"},
                                {"magnitudeClampedTicks", "clamped"},
                                {"notFiniteTicks", "not finite"}}));
}

std::string lawText(const Json& status) {
  std::string text = textAt(status, "law.chosen");
  if (flagAt(status, "law.filtered")) text += ", filtered depth";
  return line("law", text + ": " + textAt(status, "law.reason"));
}

/// The device, mode, firmware, serial number and temperature of a camera; empty where it does not report
/// them.
std::string cameraDetailsText(const Json& status) {
  const Json* details = fieldAt(status, "camera.details");
  if (!details || details->is_null()) return "";
  std::string text = fmt::format("{}, {} {} x {} at {} Hz", textAt(*details, "node"),
                                 textAt(*details, "format"), countAt(*details, "widthPx"),
                                 countAt(*details, "heightPx"), fixed(numberAt(*details, "rateHz"), 0));
  const auto add = [&](const char* title, const char* path) {
    const std::string value = textAt(*details, path);
    if (!value.empty() && value != "-") text += fmt::format(", {} {}", title, value);
  };
  add("firmware", "firmware");
  add("serial", "serial");
  const double temperature_c = numberAt(*details, "temperatureC");
  if (!std::isnan(temperature_c)) text += fmt::format(", {} degrees Celsius", fixed(temperature_c, 0));
  return line("", text);
}

std::string cameraText(const Json& status) {
  return line("camera",
              fmt::format("{}, {}", textAt(status, "camera.state"), textAt(status, "camera.identity"))) +
         line("",
              countersText(status, "camera.",
                           {{"frames", "frame(s)"}, {"damagedFrames", "damaged"}, {"lostFrames", "lost"}})) +
         cameraDetailsText(status);
}

/// Empty where the whole depth frame is modelled, or nothing yet.
std::string ballText(const Json& status) {
  const double radius_m = numberAt(status, "scene.ballRadiusM");
  if (std::isnan(radius_m)) return "";
  return line("", fmt::format("within {:.0f} mm of {} m in the world", radius_m * 1e3,
                              vectorText(status, "scene.ballCentreMInWorld", 4)));
}

std::string sceneText(const Json& status) {
  return line("scene", fmt::format("{} frames per second, {}, modelled in {}, age {}",
                                   fixed(numberAt(status, "scene.frameRateHz"), 1), sceneContentText(status),
                                   duration(numberAt(status, "scene.lastModelNs")),
                                   duration(numberAt(status, "tick.sceneAgeNs")))) +
         line("", countersText(status, "scene.",
                               {{"frames", "frame(s)"},
                                {"skippedFrames", "skipped"},
                                {"models", "model(s)"},
                                {"remodels", "of them remodelled"},
                                {"pointsOverCapacity", "point(s) over capacity"}})) +
         ballText(status) +
         line("", countersText(status, "loop.counters.",
                               {{"outsideModelTicks", "tick(s) outside the model"},
                                {"depthStaleTicks", "with stale depth"}}));
}

/// The statistics of the handle's connection; empty without any.
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

/// The latency of commands; empty if none has been sent.
std::string lastHopText(const Json& status) {
  const Json* hop = fieldAt(status, "handle.lastHop");
  if (!hop || hop->is_null()) return "";
  const double priority = numberAt(status, "handle.threadPriority");
  return line("last hop", latencyText(status, "handle.lastHop") +
                              (priority > 0 ? fmt::format(", at priority {}", fixed(priority, 0)) : ""));
}

/// The stiffness at the hand, and the rule that reduces it.
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

/// "  fixture 3.2 mm  guidance 0.15 N"; empty where there is no fixture near or acting.
std::string nearFixtureText(const Json& reply) {
  const double distance_m = numberAt(reply, "status.tick.fixtureDistanceM");
  const bool engaged = numberAt(reply, "status.tick.gain") > 0;
  const double guidance_n = engaged ? lengthAt(reply, "status.tick.guidanceForceNInWorld") : 0;
  std::string text;
  if (!std::isnan(distance_m)) text += fmt::format("  fixture {:.1f} mm", distance_m * 1e3);
  if (guidance_n > 0) text += fmt::format("  guidance {:.2f} N", guidance_n);
  return text;
}

}  // namespace

std::string contactText(const Json& status) {
  const std::string points = "from " + base::counted(countAt(status, "tick.pointsUsed"), "point(s)");
  const std::string law = textAt(status, "tick.law");
  if (law != "proxy" && law != "surface") return points;
  const std::string contact = textAt(status, "tick.contact");
  const char* const behind =
      contact == "behind" ? ", where the HIP has not come through the surface: free until it is out" : "";
  return contact + behind + (law == "proxy" ? ", " + points : "");
}

std::string sceneContentText(const Json& status) {
  if (textAt(status, "tick.law") == "surface" || textAt(status, "law.chosen") == "surface") {
    return "all pixels (the law surface works on the depth image and models no points)";
  }
  return base::counted(countAt(status, "scene.points"), "point(s)");
}

std::string statusRow(std::string_view title, const std::string& text) {
  return fmt::format("{:<14}{}", title, text);
}

std::string modeText(const Json& status) {
  const std::string cause = causeText(textAt(status, "mode"), textAt(status, "cause"));
  return textAt(status, "mode") + (cause.empty() ? "" : ": " + cause);
}

std::string bytesText(double bytes) {
  if (std::isnan(bytes)) return "-";
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  return bytes < 1e9 ? fmt::format("{:.1f} MB", bytes / 1e6) : fmt::format("{:.1f} GB", bytes / 1e9);
}

std::string traceText(const Json& status) {
  const std::string state = textAt(status, "trace.state");
  std::string text = state;
  if (state == "writing") {
    text +=
        fmt::format(" {}, {} in {}", textAt(status, "trace.name"), bytesText(numberAt(status, "trace.bytes")),
                    ageText(numberAt(status, "trace.durationS")));
  } else if (state == "waiting") {
    text += ": " + textAt(status, "trace.detail");
  }
  text += fmt::format(", {} finished since the start", countAt(status, "trace.traces"));
  text += folderText(status);
  const double free_bytes = numberAt(status, "trace.freeBytes");
  if (!std::isnan(free_bytes)) text += fmt::format(", {} free", bytesText(free_bytes));
  if (numberAt(status, "trace.ticksLost") > 0)
    text += ", " + base::counted(countAt(status, "trace.ticksLost"), "tick(s) lost");
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

std::vector<std::string> warningsOf(const Json& status) {
  std::vector<std::string> lines;
  for (const Json& warning : listAt(status, "warnings")) lines.push_back(valueText(warning));
  return lines;
}

std::string statusText(const Json& status) {
  std::string text;
  for (const std::string& line : warningsOf(status)) text += "! " + line + "\n";
  text += line("mode", fmt::format("{}, up {}", modeText(status), ageText(numberAt(status, "uptimeS"))));
  text += loopText(status) + lawText(status);
  if (const std::string stiffness = surfaceStiffnessText(status); !stiffness.empty())
    text += line("stiffness", stiffness);
  text += forceText(status);
  if (const std::string fixtures = fixturesText(status); !fixtures.empty())
    text += line("fixtures", fixtures);
  if (const std::string frames = framesText(status); !frames.empty()) text += line("frames", frames);
  if (const std::string tissue = tissueText(status); !tissue.empty()) text += line("tissue", tissue);
  text += safetyText(status) + cameraText(status) + sceneText(status) + handleText(status);
  if (const std::string leds = ledsText(status); !leds.empty()) text += line("leds", leds);
  text += line("trace", traceText(status));
  text += line("", base::counted(countAt(status, "loop.traceTicksDropped"), "tick(s) dropped"));
  text += line("", countersText(status, "trace.",
                                {{"recordsLost", "records lost"}, {"depthFramesLost", "depth frames lost"}}));
  text += line("control", countersText(status, "control.",
                                       {{"connections", "connections"},
                                        {"refusedConnections", "refused"},
                                        {"ticksLost", "ticks lost"},
                                        {"logEntriesLost", "log entries lost"},
                                        {"notificationsLost", "notifications lost"}}));
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
      "overruns {}  dropped {}{}",
      fixed(numberAt(reply, "status.uptimeS"), 1), textAt(reply, "status.mode"),
      fixed(numberAt(reply, "status.loop.rateHz"), 1), textAt(reply, "status.camera.state"),
      fixed(numberAt(reply, "status.scene.frameRateHz"), 1), fixed(contact, 0),
      fixed(numberAt(reply, "window.minForceN"), 2), fixed(numberAt(reply, "window.maxForceN"), 2),
      duration(numberAt(reply, "window.maxWakeupLatencyNs")), countAt(reply, "status.loop.counters.overruns"),
      countAt(reply, "droppedCount"), nearFixtureText(reply));
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
  return statusRow("force loop",
                   fmt::format("{} Hz, {}, {}, {}{}", fixed(numberAt(status, "loop.rateHz"), 1),
                               base::counted(countAt(status, "loop.counters.ticks"), "tick(s)"),
                               base::counted(countAt(status, "loop.counters.overruns"), "overrun(s)"),
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
  return statusRow("camera",
                   fmt::format("{}, {} fps, {}, {} damaged, {}", textAt(status, "camera.state"),
                               fixed(numberAt(status, "scene.frameRateHz"), 1),
                               base::counted(countAt(status, "camera.frames"), "frame(s)"),
                               countAt(status, "camera.damagedFrames"), textAt(status, "camera.identity")));
}

std::string sceneRow(const Json& status) {
  return statusRow("scene", fmt::format("{}, modelled in {}, age {}", sceneContentText(status),
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
