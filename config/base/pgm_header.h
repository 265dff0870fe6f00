// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string_view>

namespace hapticd::base {

/// The numbers of a binary portable graymap's header, as they are written (netpbm's pgm(5)).
struct PgmHeader {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::int64_t maximum = 0;  ///< above 255: pixels have two bytes
};

enum class PgmFault {
  other_format,  ///< it does not begin with "P5"
  damaged,       ///< a number, or the white space behind it, is missing, or a number is far too large
};

/// Reads a number of a graymap's header and the one white space behind it, after white space and comments
/// from `#` to the end of the line. Nothing if something else is there.
template <typename NextByte>
std::optional<std::int64_t> readPgmNumber(NextByte& nextByte) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  constexpr std::int64_t kMaxNumber = 1'000'000'000;
  const auto isBlank = [=](int byte) { return byte >= 0 && kBlanks.contains(static_cast<char>(byte)); };
  int byte = nextByte();
  while (byte == '#' || isBlank(byte)) {
    const bool comment = byte == '#';
    while (comment && byte >= 0 && byte != '\n') byte = nextByte();
    if (byte >= 0) byte = nextByte();
  }
  const bool negative = byte == '-';
  if (negative) byte = nextByte();
  std::int64_t number = 0;
  int digits = 0;
  for (; byte >= '0' && byte <= '9' && number <= kMaxNumber; byte = nextByte(), ++digits)
    number = 10 * number + (byte - '0');
  if (digits == 0 || number > kMaxNumber || !isBlank(byte)) return std::nullopt;
  return negative ? -number : number;
}

/// Reads the header of a graymap: "P5", width, height and maximum. `nextByte()` returns the next byte of the
/// file, or a negative number at its end; the byte after the last one taken is the first of the pixels.
template <typename NextByte>
std::expected<PgmHeader, PgmFault> readPgmHeader(NextByte nextByte) {
  if (nextByte() != 'P' || nextByte() != '5') return std::unexpected(PgmFault::other_format);
  const auto width = readPgmNumber(nextByte);
  const auto height = width ? readPgmNumber(nextByte) : std::nullopt;
  const auto maximum = height ? readPgmNumber(nextByte) : std::nullopt;
  if (!maximum) return std::unexpected(PgmFault::damaged);
  return PgmHeader{*width, *height, *maximum};
}

}  // namespace hapticd::base
