// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/list_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "config/base/counted.h"
#include "rt/base/words.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

/// A length in millimetres, because fixtures act within a few of them.
std::string millimetres(double metres) {
  return std::isnan(metres) ? "-" : fmt::format("{:.1f} mm", metres * 1e3);
}

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
               fixed(numberAt(entry, "forceN"), 2) + " N",
               fixed(numberAt(entry, "definition.max_force_n"), 1) + " N",
               millimetres(numberAt(entry, "distanceM"))});
  }
  return table.text(columns);
}

std::string regionListText(const Json& reply, std::size_t columns) {
  if (listAt(reply, "regions").empty())
    return "there are no tissue regions; 'hapticctl region add' makes one\n";
  Table table({{"NAME"}, {"PLACE"}, {"OF"}, {"MODEL"}, {"STIFFNESS", true}, {"STATE"}});
  for (const Json& entry : listAt(reply, "regions")) {
    const bool label = textAt(entry, "definition.place") == "label";
    table.add({textAt(entry, "name"),
               label ? "label " + countAt(entry, "definition.label") : textAt(entry, "definition.shape"),
               textAt(entry, "origin"), textAt(entry, "definition.model"),
               fixed(numberAt(entry, "definition.stiffness_n_per_m"), 0) + " N/m",
               flagAt(entry, "inContact") ? "in contact" : ""});
  }
  return table.text(columns);
}

namespace {

std::string joinedNames(const Json& names) {
  std::string text;
  for (const Json& name : names) text += (text.empty() ? "" : ", ") + valueText(name);
  return text;
}

std::string ageText(const Json& entry) {
  const double age_s = numberAt(entry, "ageS");
  return std::isnan(age_s) ? "-" : duration(1e9 * age_s);
}

}  // namespace

std::string frameListText(const Json& reply, std::size_t columns) {
  if (listAt(reply, "frames").empty())
    return "there are no frames; the configuration's list 'frames' makes them\n";
  Table table({{"NAME"}, {"STATE"}, {"AGE", true}, {"LAG", true}, {"ON LOSS"}, {"OF"}, {"FIXTURES"}});
  for (const Json& entry : listAt(reply, "frames")) {
    table.add({textAt(entry, "name"), textAt(entry, "state"), ageText(entry),
               millimetres(numberAt(entry, "lagM")), textAt(entry, "definition.on_loss"),
               textAt(entry, "origin"), joinedNames(listAt(entry, "fixtures"))});
  }
  return table.text(columns);
}

std::string frameText(const Json& entry) {
  std::string text = additionText(entry);
  const auto row = [&](const char* title, const std::string& value) {
    text += fmt::format("{:<26}{}\n", title, value);
  };
  row("state", textAt(entry, "state"));
  if (const std::string refusal = textAt(entry, "refusal"); refusal != "-")
    row("newest pose refused", refusal);
  row("age of the newest pose", ageText(entry));
  row("lag", millimetres(numberAt(entry, "lagM")));
  if (const std::string verdict = textAt(entry, "tracking"); verdict != "-") {
    row("tracking", fmt::format("{}, {} % of the pixels agree", verdict,
                                fixed(100 * numberAt(entry, "trackingShare"), 0)));
    row("tracking error", millimetres(numberAt(entry, "trackingErrorM")) + " next to the HIP");
  }
  if (const Json* const place = fieldAt(entry, "positionM")) row("position in the world", place->dump());
  if (const Json* const turn = fieldAt(entry, "orientationXyzw")) row("orientation x y z w", turn->dump());
  row("fixtures", joinedNames(listAt(entry, "fixtures")));
  return text;
}

std::string framesText(const Json& status) {
  std::string text;
  for (const Json& frame : listAt(status, "frames")) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", textAt(frame, "name"), textAt(frame, "state"));
    if (textAt(frame, "state") == "lost") text += " for " + ageText(frame);
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
  const auto row = [&](const char* title, const std::string& value) {
    text += fmt::format("{:<26}{}\n", title, value);
  };
  if (const double stiffness = numberAt(entry, "stiffnessNPerM"); stiffness > 0)
    row("stiffness in effect", fixed(stiffness, 1) + " N/m");
  if (const double force = numberAt(entry, "forceN"); !std::isnan(force))
    row("force exerted", fixed(force, 2) + " N");
  if (const double distance = numberAt(entry, "distanceM"); !std::isnan(distance))
    row("distance of the HIP", millimetres(distance));
  if (fieldAt(entry, "onCameraLoss")) row("while the camera is lost", textAt(entry, "onCameraLoss"));
  if (const std::string stage = textAt(entry, "stage"); stage != "-") row("stage", stage);
  if (numberAt(entry, "warnings") > 0) row("warnings", countAt(entry, "warnings"));
  if (numberAt(entry, "breaches") > 0) {
    row("breaches",
        fmt::format("{}, {} s together, at most {} deep", countAt(entry, "breaches"),
                    fixed(numberAt(entry, "breachedS"), 2), millimetres(numberAt(entry, "deepestBreachM"))));
  }
  if (!fieldAt(entry, "state") && numberAt(entry, "lagM") > 1e-4)
    row("behind its frame", millimetres(numberAt(entry, "lagM")));
  if (flagAt(entry, "nearest")) text += "nearest forbidden region\n";
  return text;
}

std::string fixturesText(const Json& status) {
  if (!(numberAt(status, "fixtures.count") > 0)) return "";
  std::string text =
      fmt::format("{} of {} enabled", countAt(status, "fixtures.enabled"), countAt(status, "fixtures.count"));
  if (const std::string nearest = textAt(status, "fixtures.nearest"); nearest != "-") {
    text += fmt::format(", nearest {} at {}{}", nearest, millimetres(numberAt(status, "fixtures.distanceM")),
                        flagAt(status, "fixtures.warning") ? " (warning)" : "");
  }
  if (const std::string contacts = contactsText(status); !contacts.empty())
    text += ", in contact: " + contacts;
  return text + fmt::format(", {} N, guidance {} N", fixed(numberAt(status, "fixtures.forceN"), 2),
                            fixed(numberAt(status, "fixtures.guidanceForceN"), 2));
}

std::string tissueText(const Json& status) {
  const bool fed = numberAt(status, "tissue.feed.accepted") > 0 ||
                   numberAt(status, "tissue.feed.limited") > 0 || numberAt(status, "tissue.feed.outside") > 0;
  if (!(numberAt(status, "tissue.count") > 0) && !fed) return "";
  std::string text = base::counted(countAt(status, "tissue.count"), "region(s)");
  if (const std::string name = textAt(status, "tissue.inContact"); name != "-")
    text += ", in contact: " + name;
  if (!fed) return text;
  return text + fmt::format("; {} measurements of stiffness, {} too fast, {} outside",
                            countAt(status, "tissue.feed.accepted"), countAt(status, "tissue.feed.limited"),
                            countAt(status, "tissue.feed.outside"));
}

std::string surfaceStiffnessText(const Json& status) {
  const double stiffness = numberAt(status, "tick.stiffnessNPerM");
  if (!(stiffness > 0)) return "";
  std::string text = fmt::format("{} N/m", fixed(stiffness, 0));
  const std::string bound = boundText(textAt(status, "tick.stiffnessBound"));
  text += bound.empty() ? ", as configured" : ", automatic, limited by " + bound;
  const double noise_m = numberAt(status, "tick.surfaceNoiseM");
  if (!std::isnan(noise_m)) text += fmt::format(", surface noise {:.2f} mm", noise_m * 1e3);
  return text;
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
               bytesText(numberAt(trace, "bytes")), stateText(trace), note == "-" ? "" : note});
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
