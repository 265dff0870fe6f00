// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::config {

/// `text` as it may stand in a message: in quotes, made printable(), at most 60 bytes of it.
std::string inQuotes(std::string_view text);

/// `text` without what steers a terminal, breaks a line, or shows nothing or something else: control
/// characters (C0, DEL, C1), separators of lines, marks that turn the direction of writing, bytes that are no
/// UTF-8. Each of their bytes becomes \xNN.
std::string printable(std::string_view text);

/// The first character that printable() would replace although it is well-formed UTF-8.
struct Unprintable {
  std::size_t at;  ///< byte where it begins
  char32_t code_point;
};
std::optional<Unprintable> firstUnprintable(std::string_view text);

/// The place of the first byte that is not part of well-formed UTF-8 (overlong forms and surrogates are not).
std::optional<std::size_t> firstInvalidUtf8(std::string_view text);

/// True for the bytes 0x00..0x1f and 0x7f.
bool isControlCharacter(char character);

/// Shortest decimal form that reads back as the same number: "500", "0.04", "1e-07".
std::string numberText(double number);

}  // namespace hapticd::config
