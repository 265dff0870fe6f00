// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace hapticd::base {

/// Returns `text` for use in a message: in quotes, made printable(), at most 60 bytes of it.
std::string inQuotes(std::string_view text);

/// Returns `text` with everything escaped that controls a terminal, breaks a line, or is invisible or
/// misleading: control characters (C0, DEL, C1), line separators, marks of writing direction, bytes that are
/// not UTF-8. Each of their bytes becomes \xNN.
std::string printable(std::string_view text);

/// The first character that printable() would escape although it is well-formed UTF-8.
struct Unprintable {
  std::size_t at;  ///< offset of its first byte
  char32_t code_point;
};
std::optional<Unprintable> firstUnprintable(std::string_view text);

/// Returns the offset of the first byte that is not part of well-formed UTF-8 (overlong forms and surrogates
/// are not).
std::optional<std::size_t> firstInvalidUtf8(std::string_view text);

/// Returns true for the bytes 0x00..0x1f and 0x7f.
bool isControlCharacter(char character);

/// Returns `text` as a number; nothing if it is not one as a whole, or does not fit the type.
template <typename Number>
std::optional<Number> numberFrom(std::string_view text) {
  Number number{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Returns the number in a text of the forms of YAML 1.2, or nothing: decimal numbers, and .inf and .nan,
/// which are recognised so that messages can name them.
std::optional<double> yamlNumberFrom(std::string_view text);

/// Returns the shortest decimal form that reads back as the same number: "500", "0.04", "1e-07".
std::string numberText(double number);

/// Returns e.g. "did you mean force.radius_m or safety.max_force_n?" with those of `candidates` (at most
/// three) that `name` was probably meant to be; empty if none is near. The last part of a dotted candidate
/// also matches alone.
std::string didYouMean(std::string_view name, std::span<const std::string_view> candidates);

/// Returns a text without the mark that some programs put in front of UTF-8.
std::string_view withoutByteOrderMark(std::string_view text);

/// Returns the names of the columns from the first line of a CSV file. Programs of tables write a byte-order
/// mark in front of it, quotes around names, blanks, and a carriage return at its end, all of which are
/// removed.
std::vector<std::string> csvNames(std::string_view line);

}  // namespace hapticd::base
