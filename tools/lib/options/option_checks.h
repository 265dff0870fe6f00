// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <CLI/Validators.hpp>

#include <array>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

#include "config/base/value_text.h"
#include "config/base/whole_file.h"

namespace hapticd::tools {

/// Returns the check of a numeric option: a finite number, or for whole numbers one without a fraction, from
/// `lowest` to `highest`. Every numeric option of the programs has it. CLI11's own Range lets NaN pass, for
/// which no comparison holds, and reads "010" as eight.
template <typename Number>
requires std::integral<Number> || std::floating_point<Number> CLI::Validator within(Number lowest,
                                                                                    Number highest) {
  const auto refusal = [lowest, highest](std::string& text) {
    const std::optional<Number> number = base::numberFrom<Number>(text);
    // written so that NaN is out of range
    if (number && *number >= lowest && *number <= highest) return std::string();
    const char* const kind = std::integral<Number> ? "whole number" : "number";
    return fmt::format("{} must be a {} from {} to {}", base::inQuotes(text), kind, lowest, highest);
  };
  const char* const kind = std::integral<Number> ? "INT" : "FLOAT";
  return {refusal, fmt::format("{} in [{} - {}]", kind, lowest, highest)};
}

/// Returns the check of an option for an output file: a name whose ending stands for a format that is
/// written. endings: ".csv", ...
template <std::convertible_to<std::string_view>... Endings>
CLI::Validator endsIn(Endings... endings) {
  const std::array<std::string_view, sizeof...(Endings)> allowed{endings...};
  const auto refusal = [allowed](std::string& file) {
    const auto good = base::checkEnding(file, allowed);
    return good ? std::string() : good.error().text();
  };
  return {refusal, ""};
}

}  // namespace hapticd::tools
