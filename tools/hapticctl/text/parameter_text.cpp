// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/parameter_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tools/lib/text/table.h"

namespace hapticd::tools {
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

}  // namespace hapticd::tools
