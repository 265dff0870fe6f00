// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/number_with_unit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>
#include <vector>

#include "config/base/value_text.h"

namespace hapticd::tools {
namespace {

struct Conversion {
  std::string_view from;
  std::string_view to;
  double multiply;
  double divide;  ///< powers of ten divide exactly where they would not multiply so
};
constexpr std::array kConversions{
    Conversion{"mm", "m", 1, 1e3},
    Conversion{"cm", "m", 1, 1e2},
    Conversion{"um", "m", 1, 1e6},
    Conversion{"mm/s", "m/s", 1, 1e3},
    Conversion{"ms", "s", 1, 1e3},
    Conversion{"us", "s", 1, 1e6},
    Conversion{"min", "s", 60, 1},
    Conversion{"mN", "N", 1, 1e3},
    Conversion{"N/mm", "N/m", 1e3, 1},
    Conversion{"g", "kg", 1, 1e3},
    Conversion{"kHz", "Hz", 1e3, 1},
    Conversion{"GB", "MB", 1e3, 1},
    Conversion{"deg", "rad", std::numbers::pi, 180},
};

}  // namespace

std::expected<std::string, std::string> inUnit(std::string_view text, std::string_view unit) {
  // the longest number that the text begins with: "1e3m" is 1000 m, and "5 e" is no power
  std::size_t length = text.size();
  while (length > 0 && !base::numberFrom<double>(text.substr(0, length))) --length;
  const std::string_view number = text.substr(0, length);
  const bool has_digit = number.find_first_of("0123456789") != std::string_view::npos;  // not "inf" of "info"
  if (!has_digit || length == text.size()) return std::string(text);
  std::string_view suffix = text.substr(length);
  while (suffix.starts_with(' ')) suffix.remove_prefix(1);
  if (suffix.empty()) return std::string(number);
  const auto isInUnits = [](unsigned char c) { return std::isalpha(c) != 0 || c == '/' || c == ' '; };
  if (!std::ranges::all_of(suffix, isInUnits)) return std::string(text);
  if (suffix == unit && !unit.empty()) return std::string(number);
  std::vector<std::string_view> others;
  for (const Conversion& conversion : kConversions) {
    if (conversion.to != unit) continue;
    if (conversion.from == suffix)
      return fmt::format("{}", *base::numberFrom<double>(number) * conversion.multiply / conversion.divide);
    others.push_back(conversion.from);
  }
  if (unit.empty()) return std::unexpected(fmt::format("has no unit; write {}", number));
  return std::unexpected(fmt::format("{} is not a unit that it takes; write the number in {}{}{}",
                                     base::inQuotes(suffix), unit, others.empty() ? "" : ", or with ",
                                     fmt::join(others, ", ")));
}

}  // namespace hapticd::tools
