// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/list_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "rt/base/words.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticctl/text/printer.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

std::string memberText(const Json& value) {
  if (!value.is_array()) return valueText(value);
  const bool nested = !value.empty() && value.front().is_array();
  std::string text;
  for (const Json& item : value) {
    const char* const gap = text.empty() ? "" : nested ? " " : ", ";
    text += gap + (nested ? "(" + memberText(item) + ")" : valueText(item));
  }
  return text;
}

/// "300 N/m", or "100 of 300 N/m" where less is in effect. A fixture that does not act has none in effect.
std::string fixtureStiffnessText(double in_effect_n_per_m, double configured_n_per_m) {
  if (!(configured_n_per_m > 0)) return "-";
  const std::string configured = fixed(configured_n_per_m, 0) + " N/m";
  const std::string in_effect = fixed(in_effect_n_per_m, 0);
  const bool same = !(in_effect_n_per_m > 0) || in_effect == fixed(configured_n_per_m, 0);
  return same ? configured : in_effect + " of " + configured;
}

/// "keep-off 1.47 N at 100 of 300 N/m" for each that exerts a force.
std::string contactsText(const Json& status) {
  std::string text;
  for (const Json& name : listAt(status, "fixtures.inContact")) {
    text += (text.empty() ? "" : ", ") + valueText(name);
    for (const Json& conduct : listAt(status, "fixtures.each")) {
      if (textAt(conduct, "name") != valueText(name)) continue;
      text += fmt::format(" {} N at {}", fixed(numberAt(conduct, "forceN"), 2),
                          fixtureStiffnessText(numberAt(conduct, "stiffnessNPerM"),
                                               numberAt(conduct, "configuredStiffnessNPerM")));
    }
  }
  return text;
}

std::string stateOf(const Json& entry) {
  if (!flagAt(entry, "enabled")) return "disabled";
  const std::string stage = textAt(entry, "stage");
  if (stage == "warning" || stage == "soft" || stage == "breach") return stage;
  const bool slows = textAt(entry, "definition.effect") == "slow";
  if (flagAt(entry, "inContact") && !slows) return "in contact";
  return stage == "contact" ? "inside" : "enabled";
}

/// What limits the automatic stiffness; empty where it is configured.
const char* boundText(const std::string& word) {
  const auto bound = rt::withWord<rt::StiffnessBound>(word);
  if (!bound) return "";
  switch (*bound) {
    case rt::StiffnessBound::configured:
      return "";
    case rt::StiffnessBound::ceiling:
      return "its ceiling";
    case rt::StiffnessBound::stability:
      return "stability";
    case rt::StiffnessBound::device:
      return "the continuous force of the device";
    case rt::StiffnessBound::noise:
      return "the noise of the surface";
    case rt::StiffnessBound::slew:
      return "the slew limit";
  }
  return "";
}

}  // namespace

std::string fixtureListText(const Json& reply, std::size_t columns) {
  if (listAt(reply, "fixtures").empty()) return "there are no fixtures; 'hapticctl fixture add' makes one\n";
  Table table({{"NAME"},
               {"KIND"},
               {"OF"},
               {"STATE"},
               {"STIFFNESS", true},
               {"FORCE", true},
               {"LARGEST FORCE", true},
               {"DISTANCE"}});
  for (const Json& entry : listAt(reply, "fixtures")) {
    table.add({textAt(entry, "name"), textAt(entry, "definition.kind"), textAt(entry, "origin"),
               stateOf(entry),
               fixtureStiffnessText(numberAt(entry, "stiffnessNPerM"),
                                    numberAt(entry, "definition.stiffness_n_per_m")),
               filled(entry, "{forceN:.2} N"), filled(entry, "{definition.max_force_n:.1} N"),
               filled(entry, "{distanceM:mm}")});
  }
  return table.text(columns);
}

std::string regionListText(const Json& reply, std::size_t columns) {
  if (listAt(reply, "regions").empty())
    return "there are no tissue regions; 'hapticctl region add' makes one\n";
  Table table({{"NAME"}, {"PLACE"}, {"OF"}, {"MODEL"}, {"STIFFNESS", true}, {"STATE"}});
  for (const Json& entry : listAt(reply, "regions")) {
    const bool label = textAt(entry, "definition.place") == "label";
    table.add(
        {textAt(entry, "name"), filled(entry, label ? "label {definition.label:#}" : "{definition.shape}"),
         textAt(entry, "origin"), textAt(entry, "definition.model"),
         filled(entry, "{definition.stiffness_n_per_m:.0} N/m"), filled(entry, "{inContact?in contact|}")});
  }
  return table.text(columns);
}

namespace {

std::string joinedNames(const Json& names) {
  std::string text;
  for (const Json& name : names) text += (text.empty() ? "" : ", ") + valueText(name);
  return text;
}

std::string poseAgeText(const Json& entry) {
  const double age_s = numberAt(entry, "ageS");
  return std::isnan(age_s) ? "-" : duration(1e9 * age_s);
}

}  // namespace

std::string frameListText(const Json& reply, std::size_t columns) {
  if (listAt(reply, "frames").empty())
    return "there are no frames; the configuration's list 'frames' makes them\n";
  Table table({{"NAME"}, {"STATE"}, {"AGE", true}, {"LAG", true}, {"ON LOSS"}, {"OF"}, {"FIXTURES"}});
  for (const Json& entry : listAt(reply, "frames")) {
    table.add({textAt(entry, "name"), textAt(entry, "state"), poseAgeText(entry), filled(entry, "{lagM:mm}"),
               textAt(entry, "definition.on_loss"), textAt(entry, "origin"),
               joinedNames(listAt(entry, "fixtures"))});
  }
  return table.text(columns);
}

namespace {

/// The rows of an entry of a list; those without text are left out.
std::string entryRows(const std::vector<Row>& rows) {
  std::string text;
  for (const auto& [title, value] : rows) {
    if (!value.empty()) text += fmt::format("{:<26}{}\n", title, value);
  }
  return text;
}

/// The pattern filled, if the number at `path` is positive; otherwise nothing.
std::string filledIfPositive(const Json& entry, std::string_view path, std::string_view pattern) {
  return numberAt(entry, path) > 0 ? filled(entry, pattern) : "";
}

/// The pattern filled, where there is a text or a number at `path`.
std::string filledIf(const Json& entry, std::string_view path, std::string_view pattern) {
  return textAt(entry, path) == "-" && std::isnan(numberAt(entry, path)) ? "" : filled(entry, pattern);
}

std::string dumpAt(const Json& entry, std::string_view path) {
  const Json* const field = fieldAt(entry, path);
  return field ? field->dump() : "";
}

}  // namespace

std::string frameText(const Json& entry) {
  const auto error = filledIf(entry, "tracking", "{trackingErrorM:mm} next to the HIP");
  return additionText(entry) +
         entryRows({{"state", textAt(entry, "state")},
                    {"newest pose refused", filledIf(entry, "refusal", "{refusal}")},
                    {"age of the newest pose", poseAgeText(entry)},
                    {"lag", filled(entry, "{lagM:mm}")},
                    {"tracking",
                     filledIf(entry, "tracking", "{tracking}, {trackingShare:.0*100} % of the pixels agree")},
                    {"tracking error", error},
                    {"position in the world", dumpAt(entry, "positionM")},
                    {"orientation x y z w", dumpAt(entry, "orientationXyzw")}}) +
         fmt::format("{:<26}{}\n", "fixtures", joinedNames(listAt(entry, "fixtures")));
}

std::string framesText(const Json& status) {
  std::string text;
  for (const Json& frame : listAt(status, "frames")) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", textAt(frame, "name"), textAt(frame, "state"));
    if (textAt(frame, "state") == "lost") text += " for " + poseAgeText(frame);
  }
  return text;
}

std::string additionText(const Json& entry) {
  std::string text;
  const Json* const definition = fieldAt(entry, "definition");
  if (definition && definition->is_object()) {
    for (auto member = definition->begin(); member != definition->end(); ++member)
      text += fmt::format("{:<26}{}\n", printable(member.key()), memberText(*member));
  }
  text += fmt::format("{:<26}{}\n", "of", textAt(entry, "origin"));
  if (flagAt(entry, "inContact")) text += "in contact\n";
  const bool lags = !fieldAt(entry, "state") && numberAt(entry, "lagM") > 1e-4;
  text += entryRows(
      {{"stiffness in effect", filledIfPositive(entry, "stiffnessNPerM", "{stiffnessNPerM:.1} N/m")},
       {"force exerted", filledIf(entry, "forceN", "{forceN:.2} N")},
       {"distance of the HIP", filledIf(entry, "distanceM", "{distanceM:mm}")},
       {"while the camera is lost", fieldAt(entry, "onCameraLoss") ? textAt(entry, "onCameraLoss") : ""},
       {"stage", filledIf(entry, "stage", "{stage}")},
       {"warnings", filledIfPositive(entry, "warnings", "{warnings:#}")},
       {"breaches",
        filledIfPositive(entry, "breaches",
                         "{breaches:#}, {breachedS:.2} s together, at most {deepestBreachM:mm} deep")},
       {"behind its frame", lags ? filled(entry, "{lagM:mm}") : ""}});
  if (flagAt(entry, "nearest")) text += "nearest forbidden region\n";
  return text;
}

std::string fixturesText(const Json& status) {
  if (!(numberAt(status, "fixtures.count") > 0)) return "";
  const std::string contacts = contactsText(status);
  return filled(status, "{fixtures.enabled:#} of {fixtures.count:#} enabled") +
         filledIf(status, "fixtures.nearest",
                  ", nearest {fixtures.nearest} at {fixtures.distanceM:mm}{fixtures.warning? (warning)|}") +
         (contacts.empty() ? "" : ", in contact: " + contacts) +
         filled(status, ", {fixtures.forceN:.2} N, guidance {fixtures.guidanceForceN:.2} N");
}

std::string tissueText(const Json& status) {
  const bool fed = numberAt(status, "tissue.feed.accepted") > 0 ||
                   numberAt(status, "tissue.feed.limited") > 0 || numberAt(status, "tissue.feed.outside") > 0;
  if (!(numberAt(status, "tissue.count") > 0) && !fed) return "";
  return filled(status, "{tissue.count:#region(s)}") +
         filledIf(status, "tissue.inContact", ", in contact: {tissue.inContact}") +
         (fed ? filled(
                    status,
                    "; {tissue.feed.accepted:#} measurements of stiffness, {tissue.feed.limited:#} too fast, "
                    "{tissue.feed.outside:#} outside")
              : "");
}

std::string surfaceStiffnessText(const Json& status) {
  if (!(numberAt(status, "tick.stiffnessNPerM") > 0)) return "";
  const std::string bound = boundText(textAt(status, "tick.stiffnessBound"));
  const std::string text = filled(status, "{tick.stiffnessNPerM:.0} N/m") +
                           (bound.empty() ? ", as configured" : ", automatic, limited by " + bound);
  if (std::isnan(numberAt(status, "tick.surfaceNoiseM"))) return text;
  return text + filled(status, ", surface noise {tick.surfaceNoiseM:.2*1000} mm");
}

namespace {

bool isNamedBy(const std::string& word, const std::string& name) {
  if (name == word) return true;
  return name.starts_with(word.ends_with('.') ? word : word + ".");
}

std::string rangeText(const Json& parameter) {
  std::string text;
  const Json* minimum = fieldAt(parameter, "minimum");
  const Json* maximum = fieldAt(parameter, "maximum");
  if (minimum && maximum && minimum->is_number() && maximum->is_number()) {
    text = fmt::format("{}..{}", valueText(*minimum), valueText(*maximum));
  }
  for (const Json& choice : listAt(parameter, "choices"))
    text += (text.empty() ? "" : "|") + valueText(choice);
  if (!text.empty()) return text;
  return textAt(parameter, "kind") == "boolean" ? "true|false" : "text";
}

std::string fieldText(const Json& parameter, const char* name) {
  const Json* field = fieldAt(parameter, name);
  if (!field || field->is_null()) return "-";
  const std::string text = valueText(*field);
  return text.empty() ? "-" : text;
}

}  // namespace

std::expected<Json, std::vector<std::string>> parametersNamed(const std::vector<std::string>& words,
                                                              const Json& parameters) {
  if (words.empty()) return parameters;
  Json named = Json::array();
  std::vector<std::string> unknown;
  for (const std::string& word : words) {
    bool any = false;
    for (const Json& parameter : parameters) {
      if (!isNamedBy(word, textAt(parameter, "name"))) continue;
      any = true;
      if (std::ranges::find(named, parameter) == named.end()) named.push_back(parameter);
    }
    if (!any) unknown.push_back(word);
  }
  if (!unknown.empty()) return std::unexpected(std::move(unknown));
  return named;
}

Json parametersWith(const std::vector<std::string>& words, const Json& parameters) {
  const auto lower = [](std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
  };
  Json found = Json::array();
  for (const Json& parameter : parameters) {
    const std::string text = lower(textAt(parameter, "name") + " " + textAt(parameter, "help"));
    const auto has = [&](const std::string& word) { return text.find(lower(word)) != std::string::npos; };
    if (std::ranges::all_of(words, has)) found.push_back(parameter);
  }
  return found;
}

std::string withUnit(const std::string& value, const Json& parameter) {
  const std::string unit = textAt(parameter, "unit");
  return unit.empty() || unit == "-" ? value : value + " " + unit;
}

std::string parameterLine(const Json& parameter) {
  return fmt::format("{} = {}", textAt(parameter, "name"),
                     withUnit(fieldText(parameter, "value"), parameter));
}

std::string parameterTableText(const Json& parameters, std::size_t columns) {
  Table table({{"NAME"}, {"VALUE"}, {"UNIT"}, {"ALLOWED"}, {"DEFAULT"}, {"EFFECT"}, {"MEANING"}});
  for (const Json& parameter : parameters) {
    const std::string symbol = textAt(parameter, "symbol");
    const std::string in_paper = symbol.empty() || symbol == "-" ? "" : " [" + symbol + " in the paper]";
    table.add({textAt(parameter, "name"), fieldText(parameter, "value"), fieldText(parameter, "unit"),
               rangeText(parameter), fieldText(parameter, "default"), textAt(parameter, "effect"),
               textAt(parameter, "help") + in_paper});
  }
  return table.text(columns);
}

namespace {

/// "2026-03-04T05-06-07Z-", what names of traces begin with in front of their label.
constexpr std::size_t kTimeLength = 21;

/// The part of a name that a person has chosen; the whole name where it does not begin with a time.
std::string labelOf(const std::string& name) {
  const bool timed = name.size() >= kTimeLength - 1 && name[kTimeLength - 2] == 'Z' && name[10] == 'T';
  if (!timed) return name;
  return name.size() > kTimeLength ? name.substr(kTimeLength) : "";
}

bool isChosen(const Json& trace, const TraceListOptions& options) {
  const auto begin_ns = traceBegin_ns(trace);
  if (options.since_ns && !(begin_ns && *begin_ns >= static_cast<double>(*options.since_ns))) return false;
  if (options.until_ns && !(begin_ns && *begin_ns <= static_cast<double>(*options.until_ns))) return false;
  if (options.state == "writing" && !flagAt(trace, "open")) return false;
  if (options.state == "finished" && (flagAt(trace, "open") || flagAt(trace, "damaged"))) return false;
  if (options.state == "damaged" && !flagAt(trace, "damaged")) return false;
  if (options.state == "kept" && !flagAt(trace, "kept")) return false;
  return labelOf(textAt(trace, "name")).find(options.label) != std::string::npos;
}

std::string stateText(const Json& trace) {
  std::string text = flagAt(trace, "open")      ? "being written"
                     : flagAt(trace, "damaged") ? "damaged original"
                                                : "finished";
  if (flagAt(trace, "kept")) text += ", kept";
  if (flagAt(trace, "depth")) text += ", with depth";
  return text;
}

double bytesOf(const Json& traces) {
  double bytes = 0;
  for (const Json& trace : traces) bytes += std::max(numberAt(trace, "bytes"), 0.0);
  return bytes;
}

}  // namespace

std::optional<double> traceBegin_ns(const Json& trace) {
  const Json* const clock = fieldAt(trace, "clockIsSet");
  if (clock != nullptr && *clock == false) return std::nullopt;
  return numberAt(trace, fieldAt(trace, "beginNs") ? "beginNs" : "timeNs");
}

std::int64_t latestBegin_ns(const Json& reply) {
  double latest_ns = 0;
  for (const Json& trace : listAt(reply, "traces")) {
    latest_ns = std::fmax(latest_ns, traceBegin_ns(trace).value_or(0));
  }
  return static_cast<std::int64_t>(latest_ns);
}

Json chosenTraces(const Json& reply, const TraceListOptions& options) {
  std::vector<Json> traces;
  for (const Json& trace : listAt(reply, "traces")) {
    if (isChosen(trace, options)) traces.push_back(trace);
  }
  // the reply is in the order of time, which traces of the same size or name keep
  if (options.sort == "name") {
    std::ranges::stable_sort(traces, {}, [](const Json& trace) { return textAt(trace, "name"); });
  } else if (options.sort == "size") {
    std::ranges::stable_sort(traces, {}, [](const Json& trace) { return numberAt(trace, "bytes"); });
  }
  if (options.reverse) std::ranges::reverse(traces);
  Json chosen = Json::array();
  for (Json& trace : traces) chosen.push_back(std::move(trace));
  return chosen;
}

std::string traceSumText(const Json& traces) {
  return fmt::format("{} {}, {}", traces.size(), traces.size() == 1 ? "trace" : "traces",
                     bytesText(bytesOf(traces)));
}

std::string traceListText(const Json& traces, const Json& reply, std::optional<std::int64_t> now_ns,
                          std::size_t columns) {
  const Json& all = listAt(reply, "traces");
  if (all.empty()) return fmt::format("there are no traces in {}\n", textAt(reply, "folder"));
  Table table({{"NAME"}, {"BEGIN"}, {"AGE", true}, {"SIZE", true}, {"STATE"}, {"NOTE"}});
  for (const Json& trace : traces) {
    const auto begin_ns = traceBegin_ns(trace);
    const std::string note = textAt(trace, "note");
    const std::string age =
        begin_ns && now_ns ? ageText((static_cast<double>(*now_ns) - *begin_ns) / 1e9) : "-";
    table.add({textAt(trace, "name"), begin_ns ? utcTime(*begin_ns) : "-", age,
               filled(trace, "{bytes:bytes}"), stateText(trace), note == "-" ? "" : note});
  }
  std::string text = (traces.empty() ? "" : table.text(columns)) + traceSumText(traces);
  if (traces.size() != all.size()) text += fmt::format(" of {}", traceSumText(all));
  if (const double omitted = numberAt(reply, "omitted"); omitted > 0) {
    text += fmt::format("; hapticd lists the newest only and left out {:.0f}", omitted);
  }
  return text + "\n";
}

TraceDeletion deletionOf(const std::vector<std::string>& names, const Json& reply) {
  TraceDeletion deletion;
  const Json& traces = listAt(reply, "traces");
  for (const std::string& name : names) {
    const auto found =
        std::ranges::find_if(traces, [&](const Json& trace) { return textAt(trace, "name") == name; });
    if (found == traces.end()) {
      deletion.problems.push_back(printable(name) + ": there is no such trace");
    } else if (flagAt(*found, "open")) {
      deletion.problems.push_back(name + " is being written (hapticctl trace stop)");
    } else if (flagAt(*found, "kept")) {
      deletion.problems.push_back(fmt::format("{0} is kept (hapticctl trace keep --undo {0})", name));
    } else if (std::ranges::find(deletion.to_delete, *found) == deletion.to_delete.end()) {
      deletion.to_delete.push_back(*found);
    }
  }
  return deletion;
}

TraceDeletion deletionBefore(std::int64_t time_ns, const Json& reply) {
  TraceDeletion deletion;
  for (const Json& trace : listAt(reply, "traces")) {
    const auto begin_ns = traceBegin_ns(trace);
    if (begin_ns && !(*begin_ns < static_cast<double>(time_ns))) continue;
    const std::string name = textAt(trace, "name");
    if (flagAt(trace, "open") || flagAt(trace, "kept")) {
      deletion.staying.push_back(name + " stays: it is kept or being written");
    } else if (!begin_ns) {
      deletion.staying.push_back(name + " stays: its age is not known, because the clock had not been set");
    } else {
      deletion.to_delete.push_back(trace);
    }
  }
  return deletion;
}

}  // namespace hapticd::tools
