// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_text.h"

#include <fmt/format.h>

#include "config/value_text.h"

namespace hapticd::config {
namespace {

std::string scalar(const Parameter& parameter, const Value& value) {
  return parameter.kind == Kind::text ? quotedText(std::get<std::string>(value)) : toText(value);
}

}  // namespace

std::string quotedText(const std::string& text) {
  std::string out = "\"";
  for (const char character : text) {
    if (character == '"' || character == '\\') out += '\\';
    if (isControlCharacter(character)) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(character));
    } else {
      out += character;
    }
  }
  return out + '"';
}

std::string yamlText(const Settings& settings, const std::function<bool(const Parameter&)>& chosen) {
  std::string text;
  std::string_view group;
  for (const Parameter& parameter : parameterTable()) {
    if (chosen && !chosen(parameter)) continue;
    const std::size_t dot = parameter.name.find('.');
    if (parameter.name.substr(0, dot) != group) {
      group = parameter.name.substr(0, dot);
      text += fmt::format("{}:\n", group);
    }
    text +=
        fmt::format("  {}: {}\n", parameter.name.substr(dot + 1), scalar(parameter, parameter.get(settings)));
  }
  return text;
}

}  // namespace hapticd::config
