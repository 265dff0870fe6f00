// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/status_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "config/settings/cause_text.h"
#include "drivers/led/led_panel.h"
#include "rt/base/words.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticctl/text/list_text.h"
#include "tools/hapticctl/text/printer.h"
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

/// Whether the reply has the field, with a value.
bool has(const Json& status, std::string_view path) {
  const Json* const field = fieldAt(status, path);
  return field && !field->is_null();
}

std::string cpuText(const Json& status) {
  const Json* cpu = fieldAt(status, "loop.cpu");
  return cpu && cpu->is_number() ? "CPU " + valueText(*cpu) : "not pinned";
}

/// The device, mode, firmware, serial number and temperature of a camera; empty where it does not report
/// them.
std::string cameraDetailsText(const Json& status) {
  if (!has(status, "camera.details")) return "";
  const Json& details = *fieldAt(status, "camera.details");
  std::string text = filled(details, "{node}, {format} {widthPx:#} x {heightPx:#} at {rateHz:.0} Hz");
  for (const char* const name : {"firmware", "serial"}) {
    const std::string value = textAt(details, name);
    if (!value.empty() && value != "-") text += fmt::format(", {} {}", name, value);
  }
  if (!std::isnan(numberAt(details, "temperatureC")))
    text += filled(details, ", {temperatureC:.0} degrees Celsius");
  return text;
}

/// Empty where the whole depth frame is modelled, or nothing yet.
std::string ballText(const Json& status) {
  if (std::isnan(numberAt(status, "scene.ballRadiusM"))) return "";
  return filled(status,
                "within {scene.ballRadiusM:.0*1000} mm of {scene.ballCentreMInWorld:(.4} m in the world");
}

/// The latency of commands; empty if none has been sent.
std::string lastHopText(const Json& status) {
  if (!has(status, "handle.lastHop")) return "";
  const bool has_priority = numberAt(status, "handle.threadPriority") > 0;
  return filled(status, "{handle.lastHop:latency}") +
         (has_priority ? filled(status, ", at priority {handle.threadPriority:.0}") : "");
}

/// The stiffness at the hand, and the rule that reduces it.
std::string stiffnessText(const Json& status) {
  const double at_hand = numberAt(status, "law.handStiffnessNPerM");
  const double gain = numberAt(status, "tick.stiffnessGain");
  const std::string damping =
      filled(status, ", {tick.contactDampingNSPerM:.2} N s/m in contact{tick.handleDamps? by the device|}");
  if (!(gain > 0 && gain < 1)) return fmt::format("{} N/m at the hand{}", fixed(at_hand, 0), damping);
  const auto rule = rt::withWord<rt::StiffnessRule>(textAt(status, "tick.stiffnessRule"));
  const char* const why = rule == rt::StiffnessRule::mass    ? "mass of the device at"
                          : rule == rt::StiffnessRule::delay ? "damping of the hand at"
                                                             : "rising again after";
  return fmt::format("{} of {} N/m at the hand ({} {}){}", fixed(at_hand, 0), fixed(at_hand / gain, 0), why,
                     filled(status, "{tick.handleDelayS:.1*1000} ms delay"), damping);
}

/// ", 12.3 of 20.0 GB in the folder"
std::string folderText(const Json& status) {
  if (std::isnan(numberAt(status, "trace.folderBytes"))) return "";
  const bool is_limited = !std::isnan(numberAt(status, "trace.folderLimitBytes"));
  return filled(status, is_limited
                            ? ", {trace.folderBytes:bytes} of {trace.folderLimitBytes:bytes} in the folder"
                            : ", {trace.folderBytes:bytes} in the folder");
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
  const std::string points = filled(status, "from {tick.pointsUsed:#point(s)}");
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
  return filled(status, "{scene.points:#point(s)}");
}

std::string modeText(const Json& status) {
  const std::string cause = causeText(textAt(status, "mode"), textAt(status, "cause"));
  return textAt(status, "mode") + (cause.empty() ? "" : ": " + cause);
}

std::string traceText(const Json& status) {
  const std::string state = textAt(status, "trace.state");
  std::string text = state;
  if (state == "writing")
    text += filled(status, " {trace.name}, {trace.bytes:bytes} in {trace.durationS:age}");
  if (state == "waiting") text += filled(status, ": {trace.detail}");
  text += filled(status, ", {trace.traces:#} finished since the start") + folderText(status);
  if (!std::isnan(numberAt(status, "trace.freeBytes")))
    text += filled(status, ", {trace.freeBytes:bytes} free");
  if (numberAt(status, "trace.ticksLost") > 0) text += filled(status, ", {trace.ticksLost:#tick(s) lost}");
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
  return filled(status, "{leds.state}, {leds.identity}: ") + patterns;
}

std::string versionsText(const Json& status) {
  return filled(status, "hapticd {version}, hapticctl " HAPTICD_VERSION ", kernel {kernel}");
}

std::vector<std::string> warningsOf(const Json& status) {
  std::vector<std::string> lines;
  for (const Json& warning : listAt(status, "warnings")) lines.push_back(valueText(warning));
  return lines;
}

namespace {

std::vector<Row> statusRows(const Json& status) {
  const auto says = [&status](std::string_view pattern) { return filled(status, pattern); };
  return {
      {"mode", modeText(status) + says(", up {uptimeS:age}")},
      {"force loop", says("{loop.rateHz:.1} Hz, ") + cpuText(status) +
                         says(", {loop.realtimeScheduling?SCHED_FIFO|no real-time scheduling}, "
                              "memory {loop.memoryLocked?locked|not locked}")},
      {"", says("{loop.counters.ticks:#tick(s)}, {loop.counters.overruns:#overrun(s)}, "
                "{loop.counters.skippedPeriods:#skipped period(s)}, {loop.pageFaults:#page fault(s)}")},
      {"wake-up", says("{loop.wakeupLatency:latency}")},
      {"compute", says("{loop.computeTime:latency}")},
      {"law", says("{law.chosen}{law.filtered?, filtered depth|}: {law.reason}")},
      {"stiffness", surfaceStiffnessText(status)},
      {"force", says("{tick.commandForceNInWorld:|.3} N {tick.commandForceNInWorld:(.3}, "
                     "by the law {tick.lawForceNInWorld:|.3} N, ") +
                    contactText(status)},
      {"", says("at {tick.hipMInWorld:(.4} m in the world")},
      {"",
       says("{loop.counters.contactTicks:#tick(s) in contact}, "
            "{loop.counters.slewLimitedTicks:#slew limited}, "
            "{loop.counters.magnitudeClampedTicks:#clamped}, {loop.counters.notFiniteTicks:#not finite}")},
      {"fixtures", fixturesText(status)},
      {"frames", framesText(status)},
      {"tissue", tissueText(status)},
      {"safety", says("{loop.counters.passivityTicks:#ticks damped for passivity}, "
                      "{loop.counters.thermallyLimitedTicks:#warm}, "
                      "{loop.counters.stiffnessLimitedTicks:#softened for delay}, ") +
                     stiffnessText(status)},
      {"camera", says("{camera.state}, {camera.identity}")},
      {"", says("{camera.frames:#frame(s)}, {camera.damagedFrames:#damaged}, {camera.lostFrames:#lost}")},
      {"", cameraDetailsText(status)},
      {"scene", says("{scene.frameRateHz:.1} frames per second, ") + sceneContentText(status) +
                    says(", modelled in {scene.lastModelNs:ns}, age {tick.sceneAgeNs:ns}")},
      {"", says("{scene.frames:#frame(s)}, {scene.skippedFrames:#skipped}, {scene.models:#model(s)}, "
                "{scene.remodels:#of them remodelled}, {scene.pointsOverCapacity:#point(s) over capacity}")},
      {"", ballText(status)},
      {"", says("{loop.counters.outsideModelTicks:#tick(s) outside the model}, "
                "{loop.counters.depthStaleTicks:#with stale depth}")},
      {"handle", says("{handle.state}, {handle.identity}{handle.exertsForce?|, exerts no force}")},
      {"", says("{handle.measurements:#measurements}, {handle.rejected:#rejected}, "
                "{loop.counters.handleStaleTicks:#ticks stale}, "
                "{loop.counters.handleInvalidTicks:#ticks invalid}, {loop.counters.releases:#releases}")},
      {"last hop", lastHopText(status)},
      {"link", !has(status, "handle.link")
                   ? ""
                   : says("{handle.link.sent:#sent}, {handle.link.received:#received}, "
                          "{handle.link.lost:#lost}, {handle.link.duplicated:#twice}, "
                          "{handle.link.reordered:#late}, {handle.link.rejected:#rejected}")},
      {"round trip", !has(status, "handle.link") ? "" : says("{handle.link.roundTrip:latency}")},
      {"leds", ledsText(status)},
      {"trace", traceText(status)},
      {"", says("{loop.traceTicksDropped:#tick(s) dropped}")},
      {"", says("{trace.recordsLost:#records lost}, {trace.depthFramesLost:#depth frames lost}")},
      {"control", says("{control.connections:#connections}, {control.refusedConnections:#refused}, "
                       "{control.ticksLost:#ticks lost}, {control.logEntriesLost:#log entries lost}, "
                       "{control.notificationsLost:#notifications lost}")},
      {"versions", versionsText(status)}};
}

/// The share of ticks in contact in a window, in percent; NaN without ticks.
std::string contactShare(const Json& reply) {
  const double ticks = numberAt(reply, "window.ticks");
  const double contact = ticks > 0 ? 100 * numberAt(reply, "window.contactTicks") / ticks : std::nan("");
  return fmt::format("  contact {:>3} %", fixed(contact, 0));
}

}  // namespace

std::string statusText(const Json& status) {
  std::string text;
  for (const std::string& line : warningsOf(status)) text += "! " + line + "\n";
  for (const auto& [title, value] : statusRows(status)) {
    if (!value.empty()) text += statusRow(title, value) + "\n";
  }
  return text;
}

std::string monitorLine(const Json& reply) {
  return filled(reply,
                "{status.uptimeS:.1>8} s  {status.mode:<9} {status.loop.rateHz:.1>7} Hz  "
                "camera {status.camera.state:<9} {status.scene.frameRateHz:.1>5} fps") +
         contactShare(reply) +
         filled(reply,
                "  force {window.minForceN:.2}..{window.maxForceN:.2} N  "
                "wake-up max {window.maxWakeupLatencyNs:ns}  overruns {status.loop.counters.overruns:#}  "
                "dropped {droppedCount:#}") +
         nearFixtureText(reply);
}

std::string liveLine(const Json& reply) {
  return filled(reply,
                "{status.uptimeS:.1>6} s {status.loop.rateHz:.1>7} Hz {status.scene.frameRateHz:.1>5} fps") +
         contactShare(reply) +
         filled(reply,
                "  force {window.maxForceN:.2>5} N  wake-up max {window.maxWakeupLatencyNs:ns>8}  "
                "{status.mode}");
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

/// The rows below the one of the mode, the most important first.
std::vector<Row> glanceRows(const Json& status) {
  const auto says = [&status](std::string_view pattern) { return filled(status, pattern); };
  const bool is_configured = textAt(status, "tick.stiffnessBound") == "configured";
  const Json* link = fieldAt(status, "handle.link");
  const bool has_link = link && link->is_object();
  return {
      {"force loop", says("{loop.rateHz:.1} Hz, {loop.counters.ticks:#tick(s)}, "
                          "{loop.counters.overruns:#overrun(s)}, "
                          "{loop.realtimeScheduling?SCHED_FIFO|no real time}{loop.memoryLocked?, locked|}")},
      {"wake-up", says("{loop.wakeupLatency:latency}")},
      {"force", says("{tick.commandForceNInWorld:|.2} N, by the law {tick.lawForceNInWorld:|.2} N, ") +
                    contactText(status) + says(", stable to {tick.stiffnessLimitNPerM:.0} N/m")},
      {"fixtures", fixturesText(status)},
      {"tissue", tissueText(status)},
      {"stiffness", is_configured ? "" : surfaceStiffnessText(status)},
      {"camera", says("{camera.state}, {scene.frameRateHz:.1} fps, {camera.frames:#frame(s)}, "
                      "{camera.damagedFrames:#} damaged, {camera.identity}")},
      {"handle", says("{handle.state}{handle.exertsForce?| without force}, "
                      "{handle.measurements:#} measurements, {handle.identity}")},
      {"trace", traceText(status)},
      {"scene",
       sceneContentText(status) + says(", modelled in {scene.lastModelNs:ns}, age {tick.sceneAgeNs:ns}")},
      {"law", says("{law.chosen}: {law.reason}")},
      {"compute", says("{loop.computeTime:latency}")},
      {"HIP", says("{tick.hipMInWorld:(.3} m in the world")},
      {"versions", versionsText(status)},
      {"leds", ledsText(status)},
      {"round trip", has_link ? says("{handle.link.roundTrip:latency}") : ""}};
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
  const std::string mode = statusRow("mode", modeText(status) + filled(status, ", up {uptimeS:age}"));
  lines.push_back(painted(cutTo(mode, columns), colourOfMode(status), style.colours));
  for (const auto& [title, text] : glanceRows(status)) {
    if (!text.empty()) lines.push_back(cutTo(statusRow(title, text), columns));
  }
  const std::size_t most = std::max<std::size_t>(style.size.rows, 2) - 1;
  if (lines.size() > most) lines.resize(most);
  return lines;
}

namespace {

std::string rateText(const Json& topic) {
  const double rate_hz = numberAt(topic, "rateHz");
  return std::isnan(rate_hz) ? "-" : fmt::format("{:.1f} Hz", rate_hz);
}

/// The names of those whom messages pass to or from; "-" for none.
std::string peersText(const Json& topic, const char* peers) {
  std::string text;
  for (const Json& peer : listAt(topic, peers)) {
    if (textAt(peer, "problem") == "-") text += (text.empty() ? "" : ", ") + textAt(peer, "name");
  }
  return text.empty() ? "-" : text;
}

/// peers: the member with them, "subscribers", which is also the title of their column.
std::string tableText(const Json& topics, const char* title, const char* peers, std::size_t columns) {
  Table table({{title}, {"type"}, {"rate", true}, {peers}});
  for (const Json& topic : topics)
    table.add({textAt(topic, "topic"), textAt(topic, "type"), rateText(topic), peersText(topic, peers)});
  return table.text(columns);
}

/// What is wrong with a topic, a line for each. `passes`: "does not reach" or "does not come from".
std::string problemsText(const Json& topic, const char* peers, const char* passes) {
  const std::string name = textAt(topic, "topic");
  std::string text;
  for (const Json& peer : listAt(topic, peers)) {
    if (const std::string problem = textAt(peer, "problem"); problem != "-")
      text += fmt::format("! {} {} {}: {}\n", name, passes, textAt(peer, "name"), problem);
    if (const std::string warning = textAt(peer, "warning"); warning != "-")
      text += fmt::format("! {} with {}: {}\n", name, textAt(peer, "name"), warning);
  }
  for (const Json& other : listAt(topic, "otherPublishers"))
    text += fmt::format("! {} is published by {}, too: subscribers cannot tell the messages apart\n", name,
                        valueText(other));
  if (numberAt(topic, "failed") > 0)
    text += fmt::format("! {}: {} messages could not be written\n", name, countAt(topic, "failed"));
  if (numberAt(topic, "refused") > 0)
    text += fmt::format("! {}: {} messages were refused, {} taken; the last one because {}\n", name,
                        countAt(topic, "refused"), countAt(topic, "taken"), textAt(topic, "lastRefusal"));
  return text;
}

}  // namespace

std::string rosStatusText(const Json& status, std::size_t columns) {
  const std::string mode = textAt(status, "mode");
  std::string text = fmt::format(
      "hapticd-ros {} publishes {}/... in domain {} at {}{}\nhapticd {}\n\n", textAt(status, "version"),
      textAt(status, "namespace"), countAt(status, "domain"), textAt(status, "interface"),
      flagAt(status, "isLoopback") ? ": only programs of this computer see it" : "",
      mode == "-" ? "does not answer it" : "is " + mode);
  const Json& published = listAt(status, "published");
  const Json& taken = listAt(status, "taken");
  text += tableText(published, "published", "subscribers", columns) + "\n";
  text += taken.empty() ? "Nothing is taken from the network (hapticd-ros --take).\n"
                        : tableText(taken, "taken", "publishers", columns);
  std::string problems;
  for (const Json& topic : published) problems += problemsText(topic, "subscribers", "does not reach");
  for (const Json& topic : taken) problems += problemsText(topic, "publishers", "does not come from");
  if (!problems.empty()) text += "\n" + fitted(problems, columns);
  return text;
}

}  // namespace hapticd::tools
