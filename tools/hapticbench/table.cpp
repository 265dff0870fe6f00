// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

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

}  // namespace hapticd::tools
