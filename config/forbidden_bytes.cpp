// SPDX-License-Identifier: Apache-2.0
#include "config/forbidden_bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "config/value_text.h"

namespace hapticd::config {
namespace {

constexpr char32_t kByteOrderMark = 0xfeff;

/// Returns the first character that text may not contain. A byte order mark is allowed at the beginning of a
/// file, and a line may end with CR LF.
std::optional<char32_t> unprintableIn(std::string_view line, bool first_line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  while (const auto found = firstUnprintable(line)) {
    const bool harmless =
        found->code_point == '\t' || (first_line && found->at == 0 && found->code_point == kByteOrderMark);
    if (!harmless) return found->code_point;
    line.remove_prefix(found->at + (found->code_point == '\t' ? 1 : 3));
    first_line = false;
  }
  return std::nullopt;
}

YamlProblem forbidden(char32_t code_point, int line) {
  const auto number = static_cast<std::uint32_t>(code_point);
  if (code_point == '\r') {
    return {line, "", "a carriage return is inside the line", "end lines with LF, or with CR LF"};
  }
  return {line, "",
          number < 0x80 ? fmt::format("control character 0x{:02x} is not allowed", number)
                        : fmt::format("the invisible character U+{:04X} is not allowed", number),
          "delete it"};
}

// Not before a comment either: YAML allows it there, but not all readers do.
bool isIndentedByTab(std::string_view line) {
  return line.substr(0, line.find_first_not_of(" \t")).contains('\t');
}

std::optional<YamlProblem> findIn(std::string_view line, int number) {
  if (const auto at = firstInvalidUtf8(line)) {
    return YamlProblem{number, "",
                       fmt::format("byte 0x{:02x} is not UTF-8", static_cast<std::uint8_t>(line[*at])),
                       "save the file as UTF-8 text"};
  }
  if (const auto code_point = unprintableIn(line, number == 1)) return forbidden(*code_point, number);
  if (isIndentedByTab(line))
    return YamlProblem{number, "", "a tab is used for indentation", "indent with spaces"};
  return std::nullopt;
}

}  // namespace

std::vector<YamlProblem> forbiddenBytesIn(std::string_view text) {
  std::vector<YamlProblem> finds;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    if (auto find = findIn(text.substr(0, end), number)) finds.push_back(std::move(*find));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return finds;
}

}  // namespace hapticd::config
