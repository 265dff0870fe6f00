// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/Validators.hpp>
#include <array>
#include <concepts>
#include <string>
#include <string_view>

#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {

/// Returns the check of an option for an output file: a name whose ending stands for a format that is
/// written. endings: ".csv", ...
template <std::convertible_to<std::string_view>... Endings>
CLI::Validator endsIn(Endings... endings) {
  const std::array<std::string_view, sizeof...(Endings)> allowed{endings...};
  const auto refusal = [allowed](std::string& file) {
    const auto good = checkEnding(file, allowed);
    return good ? std::string() : good.error().text();
  };
  return {refusal, ""};
}

}  // namespace hapticd::tools
