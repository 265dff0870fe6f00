// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/generated.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "config/settings/parameter_table.h"

namespace hapticd::tools {
namespace {

using config::Parameter;

std::vector<std::string_view> linesOf(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string linesOfParameter(const Parameter& parameter) {
  std::string help(parameter.help);
  help[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(help[0])));
  if (!parameter.symbol.empty()) help += fmt::format(" ({} in the paper)", parameter.symbol);
  const std::string value = config::toText(parameter.defaultValue());
  return fmt::format("  # {}\n  # {}: {}  # {}{}\n", help, parameter.nameInGroup(),
                     value.empty() ? "\"\"" : value, parameter.range(),
                     parameter.effect == config::Effect::live ? "; live" : "");
}

std::string parametersOf(std::string_view group) {
  std::string lines;
  for (const Parameter& parameter : config::parameterTable()) {
    if (parameter.group() == group) lines += linesOfParameter(parameter);
  }
  return lines;
}

}  // namespace

base::Result<std::string> withParameters(std::string_view configuration) {
  std::set<std::string_view> missing;
  for (const Parameter& parameter : config::parameterTable()) missing.insert(parameter.group());
  std::string text;
  bool in_group = false;
  for (const std::string_view line : linesOf(configuration)) {
    in_group = in_group && line.starts_with("  # ");
    if (in_group) continue;
    text += fmt::format("{}\n", line);
    const std::string_view name = line.substr(0, line.find(':'));
    if (!line.ends_with(':') || missing.erase(name) == 0) continue;
    text += parametersOf(name);
    in_group = true;
  }
  if (missing.empty()) return text;
  return std::unexpected(
      base::Error{"config/hapticd.yaml", fmt::format("has no group {}", fmt::join(missing, ", ")),
                  "add a comment that says what it is for, and below it the line 'NAME:'"});
}

}  // namespace hapticd::tools
