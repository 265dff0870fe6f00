#include "config/value_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace hapticd::config {
namespace {

constexpr std::size_t kLongestQuotation = 60;

std::uint8_t byteAt(std::string_view text, std::size_t at) {
  return at < text.size() ? static_cast<std::uint8_t>(text[at]) : std::uint8_t{0};
}

bool within(std::uint8_t byte, std::uint8_t lowest, std::uint8_t highest) {
  return byte >= lowest && byte <= highest;
}

// Length of the well-formed UTF-8 sequence at `at`, 0 if there is none (Unicode 15, table 3-7).
std::size_t sequenceLength(std::string_view text, std::size_t at) {
  const std::uint8_t first = byteAt(text, at);
  const std::uint8_t second = byteAt(text, at + 1);
  const bool third_follows = within(byteAt(text, at + 2), 0x80, 0xbf);
  const bool fourth_follows = within(byteAt(text, at + 3), 0x80, 0xbf);
  if (first < 0x80) return 1;
  if (within(first, 0xc2, 0xdf)) return within(second, 0x80, 0xbf) ? 2 : 0;
  if (within(first, 0xe0, 0xef)) {
    const std::uint8_t lowest = first == 0xe0 ? 0xa0 : 0x80;
    const std::uint8_t highest = first == 0xed ? 0x9f : 0xbf;
    return within(second, lowest, highest) && third_follows ? 3 : 0;
  }
  if (within(first, 0xf0, 0xf4)) {
    const std::uint8_t lowest = first == 0xf0 ? 0x90 : 0x80;
    const std::uint8_t highest = first == 0xf4 ? 0x8f : 0xbf;
    return within(second, lowest, highest) && third_follows && fourth_follows ? 4 : 0;
  }
  return 0;
}

}  // namespace

bool isControlCharacter(char character) {
  const auto byte = static_cast<std::uint8_t>(character);
  return byte < 0x20 || byte == 0x7f;
}

std::optional<std::size_t> firstInvalidUtf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = sequenceLength(text, at);
    if (length == 0) return at;
    at += length;
  }
  return std::nullopt;
}

std::string inQuotes(std::string_view text) {
  std::string shown = "\"";
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = sequenceLength(text, at);
    if (at + std::max<std::size_t>(length, 1) > kLongestQuotation) break;
    if (length == 0 || isControlCharacter(text[at])) {
      shown += fmt::format("\\x{:02x}", byteAt(text, at));
    } else {
      shown += text.substr(at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return shown + (at < text.size() ? "...\"" : "\"");
}

std::string numberText(double number) {
  return fmt::format("{}", number);
}

}  // namespace hapticd::config
