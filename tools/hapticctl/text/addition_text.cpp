// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/addition_text.h"

#include <fmt/format.h>

#include <cmath>

#include "rt/base/words.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/table.h"

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
  return flagAt(entry, "inContact") ? "in contact" : "enabled";
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
  if (numberAt(entry, "breaches") > 0) row("breaches", countAt(entry, "breaches"));
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
  std::string text = countAt(status, "tissue.count") + " regions";
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

}  // namespace hapticd::tools
