// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "tools/hapticbench/engine/report_drawing.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

std::string cellText(const Json& cell, const Figures::Heading& heading) {
  if (cell.is_discarded()) return "";
  if (cell.is_null()) return "-";
  if (cell.is_string()) return cell.get<std::string>();
  if (cell.is_boolean()) return cell.get<bool>() ? "yes" : "no";
  if (cell.is_number_float())
    return fmt::format("{:.{}f}", heading.scale * cell.get<double>(), heading.decimals);
  return cell.dump();
}

/// Appends one line of Markdown.
void addLine(std::string& text, const std::vector<std::string>& cells) {
  text += "|";
  for (const std::string& cell : cells) text += " " + cell + " |";
  text += "\n";
}

}  // namespace

std::string textOf(const Figures& figures) {
  if (figures.rows.empty()) return "";
  std::vector<Table::Column> columns;
  for (std::size_t column = 0; column < figures.headings.size(); ++column) {
    const bool words = std::ranges::any_of(figures.rows, [column](const auto& row) {
      return row[column].is_string() || row[column].is_boolean();
    });
    columns.push_back({figures.headings[column].text, !words});
  }
  Table table(std::move(columns));
  for (const auto& row : figures.rows) {
    std::vector<std::string> cells;
    for (std::size_t i = 0; i < row.size(); ++i) cells.push_back(cellText(row[i], figures.headings[i]));
    table.add(std::move(cells));
  }
  return table.text(TerminalSize::kNoLimit);
}

std::string markdownTable(const std::vector<std::string>& headings, std::size_t text_columns,
                          const std::vector<std::vector<std::string>>& rows) {
  std::string text;
  addLine(text, headings);
  text += "|";
  for (std::size_t i = 0; i < headings.size(); ++i) text += i < text_columns ? "---|" : "---:|";
  text += "\n";
  for (const auto& row : rows) addLine(text, row);
  return text;
}

namespace {

Columns<Requirement> requirementColumns() {
  using R = Requirement;
  return {{"", "verdict", 0,
           [](const R& r) { return r.cases == 0 ? "not measured"
                                   : r.met()    ? "met"
                                                : "not met"; }},
          {"/law", "law", 0, &R::law},
          {"/text", "requirement", 0, &R::text},
          {"/measured", "", 0, [](const R& r) { return figureWhere(r.cases > 0, r.measured); }},
          {"", "measured", 0,
           [](const R& r) { return figureWhere(r.cases > 0, fmt::format("{:.3g}", r.measured)); }},
          {"/limit", "", 0, [](const R& r) { return figureWhere(r.cases > 0, r.limit); }},
          {"", "limit", 0,
           [](const R& r) {
             return figureWhere(r.cases > 0,
                                fmt::format("{} {:g}", r.at_least ? "at least" : "at most", r.limit));
           }},
          {"/at_least", "", 0, &R::at_least},
          {"/cases", "cases", 0, &R::cases},
          {"/violated", "violated", 0, &R::violated},
          {"/met", "", 0, [](const R& r) { return r.met(); }},
          {"/worst", "worst case", 0, &R::worst}};
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

std::string Report::drawing(const std::filesystem::path& image) const {
  return drawing_ ? drawing_(image) : drawingOf(tables_, image);
}

void Report::requirements(std::span<const Requirement> requirements) {
  say("\nrequirements\n" + textOf(figuresOf(requirementColumns(), requirements)));
  note("requirements", tableJson(requirementColumns(), requirements));
}

}  // namespace hapticd::tools
