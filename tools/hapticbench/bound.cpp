// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/bound.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace hapticd::tools {

Bound Bound::atMost(std::string law, std::string what, double limit, double figure, const std::string& unit) {
  return {.law = std::move(law),
          .what = std::move(what),
          .limit = fmt::format("at most {:g} {}", limit, unit),
          .figure = fmt::format("{:.3g} {}", figure, unit),
          .kept = figure <= limit};
}

Bound Bound::atLeast(std::string law, std::string what, double limit, double figure,
                     const std::string& unit) {
  return {.law = std::move(law),
          .what = std::move(what),
          .limit = fmt::format("at least {:g} {}", limit, unit),
          .figure = fmt::format("{:.3g} {}", figure, unit),
          .kept = figure >= limit};
}

Bound Bound::notMeasured(std::string law, std::string what) {
  return {.law = std::move(law), .what = std::move(what), .limit = "", .figure = "", .kept = false};
}

std::string boundsTable(std::span<const Bound> bounds) {
  fmt::memory_buffer text;
  for (const Bound& bound : bounds) {
    const bool measured = !bound.figure.empty();
    fmt::format_to(std::back_inserter(text), "{:<13}{:<9}{:<78}{:>12}{}\n",
                   !measured    ? "not measured"
                   : bound.kept ? "kept"
                                : "NOT KEPT",
                   bound.law, bound.what, bound.figure, measured ? "  " + bound.limit : "");
  }
  return fmt::to_string(text);
}

std::string boundsJson(std::span<const Bound> bounds) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  for (const Bound& bound : bounds) {
    document.push_back({{"law", bound.law},
                        {"what", bound.what},
                        {"limit", bound.limit},
                        {"figure", bound.figure},
                        {"measured", !bound.figure.empty()},
                        {"kept", bound.kept}});
  }
  return document.dump();
}

}  // namespace hapticd::tools
