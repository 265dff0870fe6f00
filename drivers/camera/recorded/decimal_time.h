// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>

namespace hapticd::drivers {

/// Converts all of `text` to a number; nothing if it is not a number or does not fit.
template <typename Number>
std::optional<Number> wholeNumber(std::string_view text) {
  Number number{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Converts e.g. "1513096835.219278" to nanoseconds, without the rounding of floating-point numbers. Nothing
/// if the text is not a decimal number of seconds from 0 to 2^32.
std::optional<std::int64_t> decimalSecondsInNs(std::string_view text);

}  // namespace hapticd::drivers
