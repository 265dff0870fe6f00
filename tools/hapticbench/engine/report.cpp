// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace hapticd::tools {
namespace {

std::string cellText(const Json& cell, const TextTable::Heading& heading) {
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

std::string textOf(const TextTable& table) {
  if (table.rows.empty()) return "";
  std::vector<std::string> lines(table.rows.size() + 1);
  for (std::size_t column = 0; column < table.headings.size(); ++column) {
    const TextTable::Heading& heading = table.headings[column];
    std::vector<std::string> cells{heading.text};
    for (const auto& row : table.rows) cells.push_back(cellText(row[column], heading));
    const auto longer = [](const std::string& a, const std::string& b) { return a.size() < b.size(); };
    const std::size_t width = std::ranges::max_element(cells, longer)->size();
    const bool words = std::ranges::any_of(table.rows, [column](const auto& row) {
      return row[column].is_string() || row[column].is_boolean();
    });
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (column > 0) lines[i] += "  ";
      lines[i] += words ? fmt::format("{:<{}}", cells[i], width) : fmt::format("{:>{}}", cells[i], width);
    }
  }
  std::string text;
  for (std::string& line : lines) {
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
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
                                   : r.kept()   ? "kept"
                                                : "NOT KEPT"; }},
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
          {"/kept", "", 0, [](const R& r) { return r.kept(); }},
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

void Report::requirements(std::span<const Requirement> requirements) {
  say("\nrequirements\n");
  table("requirements", "", requirementColumns(), requirements);
}

}  // namespace hapticd::tools
