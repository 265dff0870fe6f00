// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::config {

/// A line of a GPIO chip as named in the configuration.
struct LineAddress {
  std::string name;         ///< as shown by the kernel; empty: the line is found by its offset
  int offset = 0;           ///< 0..kMaxLineOffset, index on the chip; meaningless if there is a name
  bool active_low = false;  ///< the LED is on at the low level

  bool operator==(const LineAddress&) const = default;
};

inline constexpr int kMaxLineOffset = 65535;

/// Parses "NAME" or "OFFSET", each optionally followed by " active-low" if the LED is on at the low level.
/// Digits alone are an offset.
/// Errors (without a place): empty, an offset out of range, a name that no line can have.
base::Result<LineAddress> lineAddressFrom(std::string_view text);

/// Returns e.g. "line 17" or "line \"STATUS\"".
std::string textOf(const LineAddress& line);

}  // namespace hapticd::config
