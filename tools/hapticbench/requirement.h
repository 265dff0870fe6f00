// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "tools/hapticbench/table.h"

namespace hapticd::tools {

/// A limit on a figure, and how it is kept.
struct Requirement {
  std::string law;   ///< empty: not of a single law
  std::string text;  ///< what is limited, with its unit at the end: "contact lost, %"
  double measured = 0;
  double limit = 0;
  bool at_least = false;     ///< else at most
  std::size_t cases = 1;     ///< that it was checked on; 0: not measured
  std::size_t violated = 0;  ///< of them
  std::string worst;         ///< the case that `measured` is of, where there are several

  bool kept() const { return cases > 0 && violated == 0; }
  static Requirement atMost(std::string law, std::string text, double limit, double measured);
  static Requirement atLeast(std::string law, std::string text, double limit, double measured);
  static Requirement notMeasured(std::string law, std::string text);
};

/// Returns a line of text for each requirement.
std::string requirementsText(std::span<const Requirement> requirements);
Json requirementsJson(std::span<const Requirement> requirements);

/// The figure of a row that a requirement limits, and its limit.
struct LimitedFigure {
  double value = 0;
  double limit = 0;
};

/// A requirement that is checked row by row. `figure` gives nothing for a row that it does not apply to.
template <typename Row>
struct RowRequirement {
  std::string text;
  std::function<std::optional<LimitedFigure>(const Row&)> figure;
};

/// `value` and `limit` where the requirement applies.
inline std::optional<LimitedFigure> figureIf(bool applies, double value, double limit) {
  return applies ? std::optional(LimitedFigure{value, limit}) : std::nullopt;
}

/// Checks the rows that `belongs` holds for; the worst one is the one farthest beyond its limit or nearest to
/// it. `describe` names the row.
template <typename Row, typename Rows, typename Belongs, typename Describe>
Requirement checked(const std::string& law, const RowRequirement<Row>& requirement, const Rows& rows,
                    const Belongs& belongs, const Describe& describe) {
  constexpr double kRounding = 1e-9;
  Requirement result{.law = law, .text = requirement.text, .cases = 0, .worst = {}};
  for (const Row& row : rows) {
    const auto figure = belongs(row) ? requirement.figure(row) : std::nullopt;
    if (!figure) continue;
    if (figure->value > figure->limit + kRounding) ++result.violated;
    if (result.cases++ > 0 && figure->value - figure->limit <= result.measured - result.limit) continue;
    result.measured = figure->value;
    result.limit = figure->limit;
    result.worst = describe(row);
  }
  return result;
}

}  // namespace hapticd::tools
