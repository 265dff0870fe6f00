// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "config/parameter_rows.h"
#include "config/parameter_table.h"

/// The rows of the stiffness, which is a number or chosen automatically. While it is automatic, the stiffness
/// of the springs is the ceiling, in whichever order the two are set.
namespace hapticd::config {

inline constexpr std::string_view kAutomaticStiffness = "auto";
inline constexpr std::array kStiffnessWords{kAutomaticStiffness};

constexpr Parameter stiffnessRow(std::string_view name, Range range, std::string_view help) {
  return {.name = name,
          .kind = Kind::number,
          .effect = Effect::live,
          .unit = "N/m",
          .minimum = range.minimum,
          .maximum = range.maximum,
          .choices = kStiffnessWords,
          .choice_help = {},
          .symbol = "k_s",
          .help = help,
          .get = [](const Settings& settings) -> Value {
            if (settings.live.automatic_stiffness.on) return std::string(kAutomaticStiffness);
            return settings.live.springs.stiffness_n_per_m;
          },
          .set =
              [](Settings& settings, const Value& value) {
                const auto* const number = std::get_if<double>(&value);
                rt::AutomaticStiffnessParameters& automatic = settings.live.automatic_stiffness;
                automatic.on = number == nullptr;
                settings.live.springs.stiffness_n_per_m =
                    number != nullptr ? *number : automatic.ceiling_n_per_m;
              }};
}

constexpr Parameter stiffnessCeilingRow(std::string_view name, Range range, std::string_view help) {
  Parameter ceiling = row<HAPTICD_MEMBER(live.automatic_stiffness.ceiling_n_per_m)>(name, Effect::live, "N/m",
                                                                                    range, "", help);
  ceiling.set = [](Settings& settings, const Value& value) {
    rt::AutomaticStiffnessParameters& automatic = settings.live.automatic_stiffness;
    automatic.ceiling_n_per_m = std::get<double>(value);
    if (automatic.on) settings.live.springs.stiffness_n_per_m = automatic.ceiling_n_per_m;
  };
  ceiling.looser = Looser::higher;
  return ceiling;
}

}  // namespace hapticd::config
