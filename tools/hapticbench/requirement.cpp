// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/requirement.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

namespace hapticd::tools {
namespace {

Json ifMeasured(const Requirement& requirement, Json figure) {
  return requirement.cases > 0 ? std::move(figure) : noFigure();
}

const std::vector<Column<Requirement>>& columns() {
  using R = Requirement;
  static const std::vector<Column<Requirement>> all{
      {"", "verdict", 0,
       [](const R& r) { return r.cases == 0 ? "not measured"
                               : r.kept()   ? "kept"
                                            : "NOT KEPT"; }},
      {"/law", "law", 0, &R::law},
      {"/text", "requirement", 0, &R::text},
      {"/measured", "", 0, [](const R& r) { return ifMeasured(r, r.measured); }},
      {"", "measured", 0, [](const R& r) { return ifMeasured(r, fmt::format("{:.3g}", r.measured)); }},
      {"/limit", "", 0, [](const R& r) { return ifMeasured(r, r.limit); }},
      {"", "limit", 0,
       [](const R& r) {
         return ifMeasured(r, fmt::format("{} {:g}", r.at_least ? "at least" : "at most", r.limit));
       }},
      {"/at_least", "", 0, &R::at_least},
      {"/cases", "cases", 0, &R::cases},
      {"/violated", "violated", 0, &R::violated},
      {"/kept", "", 0, [](const R& r) { return r.kept(); }},
      {"/worst", "worst case", 0, &R::worst}};
  return all;
}

}  // namespace

Requirement Requirement::atMost(std::string law, std::string text, double limit, double measured) {
  return {.law = std::move(law),
          .text = std::move(text),
          .measured = measured,
          .limit = limit,
          .violated = measured <= limit ? 0U : 1U,
          .worst = {}};
}

Requirement Requirement::atLeast(std::string law, std::string text, double limit, double measured) {
  Requirement requirement = atMost(std::move(law), std::move(text), limit, measured);
  requirement.at_least = true;
  requirement.violated = measured >= limit ? 0U : 1U;
  return requirement;
}

Requirement Requirement::notMeasured(std::string law, std::string text) {
  return {.law = std::move(law), .text = std::move(text), .cases = 0, .worst = {}};
}

std::string requirementsText(std::span<const Requirement> requirements) {
  return "\nrequirements\n" + tableText(columns(), requirements);
}

Json requirementsJson(std::span<const Requirement> requirements) {
  return tableJson(columns(), requirements);
}

}  // namespace hapticd::tools
