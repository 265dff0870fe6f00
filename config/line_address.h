// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/error.h"

namespace hapticd::config {

/// A line of a GPIO chip, as the configuration names it.
struct LineAddress {
  std::string name;         ///< as the kernel shows it; empty: the line is found by its offset
  int offset = 0;           ///< 0..kMaxLineOffset, counted on the chip; without meaning where there is a name
  bool active_low = false;  ///< on is the low level

  bool operator==(const LineAddress&) const = default;
};

inline constexpr int kMaxLineOffset = 65535;

/// From "NAME" or "OFFSET", each with " active-low" behind it where on is the low level. Digits alone are an
/// offset.
/// Errors (without a place): no line, an offset out of range, a name that no line can have.
Result<LineAddress> lineAddressFrom(std::string_view text);

/// "line 17" or "line \"STATUS\"".
std::string textOf(const LineAddress& line);

}  // namespace hapticd::config
