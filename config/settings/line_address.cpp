// SPDX-License-Identifier: Apache-2.0
#include "config/settings/line_address.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

// GPIO_MAX_NAME_SIZE of Linux without the terminating NUL.
constexpr std::size_t kMaxLineNameLength = 31;

constexpr std::string_view kActiveLow = " active-low";
constexpr std::string_view kForm = "write it as NAME, OFFSET, NAME active-low or OFFSET active-low";

std::unexpected<base::Error> refused(std::string_view text, std::string_view why,
                                     std::string_view remedy = kForm) {
  return std::unexpected(
      base::Error{"", fmt::format("{} {}", base::inQuotes(text), why), std::string(remedy)});
}

bool isDigit(char character) {
  return character >= '0' && character <= '9';
}

base::Result<LineAddress> withOffset(std::string_view digits, LineAddress line) {
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), line.offset);
  if (failure == std::errc() && line.offset <= kMaxLineOffset) return line;
  return refused(digits, fmt::format("is not the offset of a line (allowed: 0..{})", kMaxLineOffset),
                 "gpioinfo lists the lines of each chip");
}

base::Result<LineAddress> withName(std::string_view name, LineAddress line) {
  if (name.size() > kMaxLineNameLength) {
    return refused(
        name, fmt::format("has {} bytes, the name of a line at most {}", name.size(), kMaxLineNameLength),
        "gpioinfo lists the lines of each chip");
  }
  // A misspelt suffix would be part of the name, and no such line would ever be found.
  if (name.find(" active") != std::string_view::npos) return refused(name, "does not end in \"active-low\"");
  line.name = name;
  return line;
}

}  // namespace

base::Result<LineAddress> lineAddressFrom(std::string_view text) {
  LineAddress line;
  line.active_low = text.ends_with(kActiveLow);
  std::string_view line_text = text;
  if (line.active_low) line_text.remove_suffix(kActiveLow.size());
  if (line_text.empty() || text == kActiveLow.substr(1)) return refused(text, "names no line");
  if (line_text.front() == ' ' || line_text.back() == ' ')
    return refused(text, "has an extra space", "write one space before active-low and no other spaces");
  return std::ranges::all_of(line_text, isDigit) ? withOffset(line_text, line) : withName(line_text, line);
}

std::string textOf(const LineAddress& line) {
  return line.name.empty() ? fmt::format("line {}", line.offset) : "line " + base::inQuotes(line.name);
}

}  // namespace hapticd::config
