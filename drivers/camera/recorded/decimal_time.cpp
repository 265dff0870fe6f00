// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/decimal_time.h"

#include <algorithm>

#include "rt/clock.h"

namespace hapticd::drivers {

std::optional<std::int64_t> decimalSecondsInNs(std::string_view text) {
  constexpr std::size_t kMaxDigits = 9;
  const std::size_t point = text.find('.');
  const auto seconds = wholeNumber<std::uint32_t>(text.substr(0, point));
  if (!seconds) return std::nullopt;
  std::int64_t fraction_ns = 0;
  if (point != std::string_view::npos) {
    const std::string_view digits = text.substr(point + 1);
    const auto fraction = wholeNumber<std::uint32_t>(digits.substr(0, kMaxDigits));
    if (!fraction || !std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; })) {
      return std::nullopt;
    }
    fraction_ns = *fraction;
    for (std::size_t digit = digits.size(); digit < kMaxDigits; ++digit) fraction_ns *= 10;
  }
  return std::int64_t{*seconds} * rt::kNsPerSecond + fraction_ns;
}

}  // namespace hapticd::drivers
