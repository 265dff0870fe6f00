// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/parameter_section.h"

#include <fmt/format.h>

#include <cctype>
#include <cstddef>

#include "config/parameter_table.h"
#include "tools/manual/roff.h"

namespace hapticd::tools {
namespace {

std::string sentence(std::string_view text) {
  std::string capital(text);
  capital.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(capital.front())));
  return capital + ".";
}

/// Which values are looser; empty: the parameter is no limit.
std::string looserValues(const config::Parameter& parameter) {
  const bool higher = parameter.looser != config::Looser::lower;
  if (parameter.looser == config::Looser::never) return "";
  if (parameter.kind == config::Kind::boolean) return higher ? "true" : "false";
  if (parameter.kind == config::Kind::choice) return higher ? "later words" : "earlier words";
  if (parameter.looser == config::Looser::higher_or_zero) return "higher values, and 0";
  return higher ? "higher values" : "lower values";
}

std::string paragraph(const config::Parameter& parameter) {
  std::string text = sentence(parameter.help);
  if (!parameter.symbol.empty()) text += " In the paper: " + std::string(parameter.symbol) + ".";
  const std::string value = config::toText(parameter.defaultValue());
  text += "\nAllowed: " + parameter.range() + ". Default: " + (value.empty() ? "empty" : value) + ".";
  if (parameter.effect == config::Effect::live) text += " Live.";
  if (const std::string looser = looserValues(parameter); !looser.empty()) text += " Looser: " + looser + ".";
  for (std::size_t i = 0; i < parameter.choice_help.size(); ++i)
    text += fmt::format("\n{}: {}.", parameter.choices[i], parameter.choice_help[i]);
  return labelled(parameter.name, text);
}

}  // namespace

std::string parameterSection() {
  std::string section;
  std::string_view group;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (parameter.group() != group) section += ".SS " + plainRoff(parameter.group()) + "\n";
    group = parameter.group();
    section += paragraph(parameter);
  }
  return section;
}

}  // namespace hapticd::tools
