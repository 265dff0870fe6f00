// SPDX-License-Identifier: Apache-2.0
#include "config/settings/yaml_text.h"

#include <fmt/format.h>

#include "config/base/value_text.h"

namespace hapticd::config {
std::string quotedText(const std::string& text) {
  std::string out = "\"";
  for (const char character : text) {
    if (character == '"' || character == '\\') out += '\\';
    if (base::isControlCharacter(character)) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(character));
    } else {
      out += character;
    }
  }
  return out + '"';
}

std::string quotedText(const Value& value) {
  const auto* const text = std::get_if<std::string>(&value);
  return text != nullptr ? quotedText(*text) : toText(value);
}

std::string yamlText(const Settings& settings, const std::function<bool(const Parameter&)>& chosen) {
  std::string text;
  for (const std::string_view group : parameterGroups()) {
    std::string lines;
    for (const Parameter& parameter : allParameters()) {
      if (parameter.group() != group || (chosen && !chosen(parameter))) continue;
      const Value value = parameter.get(settings);
      lines += fmt::format("  {}: {}\n", parameter.nameInGroup(),
                           parameter.kind == Kind::text ? quotedText(value) : toText(value));
    }
    if (!lines.empty()) text += fmt::format("{}:\n{}", group, lines);
  }
  return text;
}

}  // namespace hapticd::config
