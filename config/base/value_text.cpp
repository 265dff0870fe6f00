// SPDX-License-Identifier: Apache-2.0
#include "config/base/value_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace hapticd::base {
namespace {

constexpr std::size_t kMaxQuotationLength = 60;

std::uint8_t byteAt(std::string_view text, std::size_t at) {
  return at < text.size() ? static_cast<std::uint8_t>(text[at]) : std::uint8_t{0};
}

bool within(std::uint8_t byte, std::uint8_t lowest, std::uint8_t highest) {
  return byte >= lowest && byte <= highest;
}

// Returns the length of the well-formed UTF-8 sequence at `at`; 0 if there is none (Unicode 15, table 3-7).
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

/// Returns the code point of the well-formed sequence of `length` bytes at `at`.
char32_t codePointAt(std::string_view text, std::size_t at, std::size_t length) {
  constexpr std::uint8_t kFirstByteMask[] = {0, 0x7f, 0x1f, 0x0f, 0x07};
  char32_t code_point = byteAt(text, at) & kFirstByteMask[length];
  for (std::size_t i = 1; i < length; ++i) code_point = code_point << 6 | (byteAt(text, at + i) & 0x3f);
  return code_point;
}

bool isUnprintable(char32_t code_point) {
  const auto within = [code_point](char32_t first, char32_t last) {
    return code_point >= first && code_point <= last;
  };
  return within(0, 0x1f) || within(0x7f, 0x9f) || within(0x2028, 0x202e) || within(0x2066, 0x2069) ||
         within(0xfff9, 0xfffb) || code_point == 0xfeff || (code_point & 0xfffe) == 0xfffe;
}

/// Returns the next character in printable form and advances `at` past it.
std::string nextShown(std::string_view text, std::size_t& at) {
  const std::size_t length = sequenceLength(text, at);
  const std::size_t bytes = std::max<std::size_t>(length, 1);
  const std::string_view character = text.substr(at, bytes);
  const bool shown = length > 0 && !isUnprintable(codePointAt(text, at, length));
  at += bytes;
  if (shown) return std::string(character);
  std::string escaped;
  for (const char byte : character) escaped += fmt::format("\\x{:02x}", static_cast<std::uint8_t>(byte));
  return escaped;
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

std::string printable(std::string_view text) {
  std::string shown;
  for (std::size_t at = 0; at < text.size();) shown += nextShown(text, at);
  return shown;
}

std::optional<Unprintable> firstUnprintable(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = sequenceLength(text, at);
    const char32_t code_point = length > 0 ? codePointAt(text, at, length) : U'x';
    if (isUnprintable(code_point)) return Unprintable{at, code_point};
    at += std::max<std::size_t>(length, 1);
  }
  return std::nullopt;
}

std::string inQuotes(std::string_view text) {
  std::string shown = "\"";
  for (std::size_t at = 0; at < text.size();) {
    if (at + std::max<std::size_t>(sequenceLength(text, at), 1) > kMaxQuotationLength) return shown + "...\"";
    shown += nextShown(text, at);
  }
  return shown + '"';
}

std::optional<double> yamlNumberFrom(std::string_view text) {
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::nan("");
  std::string_view rest = text;
  if (rest.starts_with('+')) rest.remove_prefix(1);
  const bool signed_twice = rest.size() != text.size() && rest.starts_with('-');
  const std::string_view magnitude = rest.starts_with('-') ? rest.substr(1) : rest;
  if (magnitude == ".inf" || magnitude == ".Inf" || magnitude == ".INF") return HUGE_VAL;
  double number = 0;
  const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (signed_twice || failure == std::errc::invalid_argument || end != rest.data() + rest.size()) {
    return std::nullopt;
  }
  // Too large for a double, or too small to be distinguished from zero by any parameter's range; both are
  // refused.
  if (failure == std::errc::result_out_of_range) return std::numeric_limits<double>::max();
  return number;
}

std::string numberText(double number) {
  return fmt::format("{}", number);
}

namespace {

constexpr std::size_t kMaxSuggestions = 3;
constexpr std::size_t kMaxNameLength = 64;  // longer ones are not near anything; bounds the work

// Returns the number of characters to insert, delete or replace to turn one into the other (Levenshtein).
std::size_t editDistance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string_view lastPart(std::string_view name) {
  return name.substr(name.rfind('.') + 1);
}

bool isPartOf(std::string_view part, std::string_view whole) {
  return part.size() >= 4 && whole.find(part) != std::string_view::npos;
}

// 0: the same name; a correct last part in the wrong group counts as one wrong character.
std::size_t distance(std::string_view name, std::string_view candidate) {
  if (isPartOf(lastPart(name), lastPart(candidate))) return 1;
  return std::min(editDistance(name, candidate), editDistance(lastPart(name), lastPart(candidate)) + 1);
}

}  // namespace

std::string didYouMean(std::string_view name, std::span<const std::string_view> candidates) {
  if (name.size() > kMaxNameLength) return {};
  const std::size_t farthest = std::max<std::size_t>(1, lastPart(name).size() / 3);
  std::vector<std::pair<std::size_t, std::string_view>> near;
  for (const std::string_view candidate : candidates) {
    const std::size_t steps = distance(name, candidate);
    if (steps <= farthest) near.emplace_back(steps, candidate);
  }
  if (near.empty()) return {};
  std::ranges::stable_sort(near, {}, &std::pair<std::size_t, std::string_view>::first);
  near.resize(std::min(near.size(), kMaxSuggestions));
  std::vector<std::string_view> names;
  for (const auto& [steps, candidate] : near) names.push_back(candidate);
  return fmt::format("did you mean {}?", fmt::join(names, " or "));
}

namespace {

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

}  // namespace

std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return text;
}

std::vector<std::string> csvNames(std::string_view line) {
  line = withoutByteOrderMark(line);
  if (line.ends_with('\r')) line.remove_suffix(1);
  std::vector<std::string> names;
  for (;;) {
    const std::size_t comma = line.find(',');
    std::string_view name = trimmed(line.substr(0, comma));
    const bool quoted = name.size() > 1 && name.starts_with('"') && name.ends_with('"');
    if (quoted) name = name.substr(1, name.size() - 2);
    names.emplace_back(name);
    if (comma == std::string_view::npos) return names;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace hapticd::base
