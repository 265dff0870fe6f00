#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::config {

/// `text` as it may stand in a message: in quotes, what is not printable ASCII escaped as \xNN unless it is
/// valid UTF-8, at most 60 bytes of it.
std::string inQuotes(std::string_view text);

/// The place of the first byte that is not part of well-formed UTF-8 (overlong forms and surrogates are not).
std::optional<std::size_t> firstInvalidUtf8(std::string_view text);

/// True for the bytes 0x00..0x1f and 0x7f.
bool isControlCharacter(char character);

/// Shortest decimal form that reads back as the same number: "500", "0.04", "1e-07".
std::string numberText(double number);

}  // namespace hapticd::config
