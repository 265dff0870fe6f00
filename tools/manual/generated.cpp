// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/generated.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "config/additions/addition_fields.h"
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

/// The third cell of a row whose first one names a member, filled with what is allowed; and the member
/// crossed out of `missing`.
std::string rowOfMember(const config::AdditionType& type, std::string_view line,
                        std::set<std::string_view>& missing) {
  for (const config::AdditionField& field : type.fields) {
    if (!line.starts_with(fmt::format("| `{}` | ", field.name))) continue;
    const std::size_t kinds = line.find(" | ") + 3;
    const std::size_t begin = line.find(" | ", kinds);
    const std::size_t end = begin == line.npos ? begin : line.find(" | ", begin + 3);
    if (end == line.npos) break;
    missing.erase(field.name);
    return fmt::format("{} | {}{}", line.substr(0, begin), rangeOf(field), line.substr(end));
  }
  return std::string(line);
}

/// The section of a document about the members of a list, with what is allowed in each row of its table.
base::Result<std::string> withRanges(std::string_view document, const config::AdditionType& type) {
  const std::string heading = fmt::format("### Members of {}", type.list);
  std::set<std::string_view> missing;
  for (const config::AdditionField& field : type.fields) missing.insert(field.name);
  std::string text;
  bool inside = false;
  for (const std::string_view line : linesOf(document)) {
    if (line.starts_with('#')) inside = line == heading;
    text += (inside ? rowOfMember(type, line, missing) : std::string(line)) + "\n";
  }
  if (missing.empty()) return text;
  return std::unexpected(base::Error{
      "docs/fixtures.md", fmt::format("has no row of {} below '{}'", fmt::join(missing, ", "), heading),
      "write one with its name, kinds, anything, default and meaning"});
}

}  // namespace

base::Result<std::string> withMembers(std::string_view document) {
  base::Result<std::string> text(document);
  for (const config::AdditionType* type :
       {&typeOf(config::FixtureSettings{}), &typeOf(config::FrameSettings{}),
        &typeOf(config::RegionSettings{})})
    if (text) text = withRanges(*text, *type);
  return text;
}

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
