#include "config/forbidden_bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "config/value_text.h"

namespace hapticd::config {
namespace {

bool isForbiddenControl(char character) {
  return isControlCharacter(character) && character != '\t' && character != '\r';
}

bool isIndentedByTab(std::string_view line) {
  const std::size_t indentation = std::min(line.find_first_not_of(" \t"), line.size());
  const std::string_view rest = line.substr(indentation);
  const bool says_something = !rest.empty() && rest.front() != '#' && rest.front() != '\r';
  return says_something && line.substr(0, indentation).contains('\t');
}

std::optional<ForbiddenBytes> findIn(std::string_view line, int number) {
  if (const auto at = firstInvalidUtf8(line)) {
    return ForbiddenBytes{number,
                          fmt::format("byte 0x{:02x} is not UTF-8", static_cast<std::uint8_t>(line[*at])),
                          "save the file as UTF-8 text"};
  }
  const auto control = std::ranges::find_if(line, isForbiddenControl);
  if (control != line.end()) {
    return ForbiddenBytes{
        number, fmt::format("control character 0x{:02x} is not allowed", static_cast<std::uint8_t>(*control)),
        "delete it"};
  }
  if (isIndentedByTab(line))
    return ForbiddenBytes{number, "a tab stands in the indentation", "indent with spaces"};
  return std::nullopt;
}

}  // namespace

std::vector<ForbiddenBytes> forbiddenBytesIn(std::string_view text) {
  std::vector<ForbiddenBytes> finds;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    if (auto find = findIn(text.substr(0, end), number)) finds.push_back(std::move(*find));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return finds;
}

}  // namespace hapticd::config
