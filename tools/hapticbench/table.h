// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/hapticbench/statistics.h"

/// One description of a study's figures for all its reports: text for people, JSON for programs.
namespace hapticd::tools {

using Json = nlohmann::ordered_json;

/// A figure that a row does not have: a blank cell in text, no member in JSON.
inline Json noFigure() {
  return Json(Json::value_t::discarded);
}

/// One figure of a row.
template <typename Row>
struct Column {
  std::string key;      ///< JSON pointer of the member: "/gap_m", "/error_n/rms"; empty: not in JSON
  std::string heading;  ///< in text, with the unit; empty: not in text
  int decimals = 0;     ///< in text, of numbers that are not whole
  std::function<Json(const Row&)> figure;
  double scale = 1;  ///< in text: 1000 shows metres as millimetres
};

/// Adds the RMS and the maximum of a spread: the members "rms" and "max" of the object at `key`.
template <typename Row, typename SpreadOf>
void addSpread(std::vector<Column<Row>>& columns, const std::string& key, const std::string& rms_heading,
               const std::string& max_heading, const SpreadOf& spread) {
  constexpr int kDecimals = 2;
  columns.push_back(
      {key + "/rms", rms_heading, kDecimals, [spread](const Row& row) { return spread(row).rms(); }});
  columns.push_back(
      {key + "/max", max_heading, kDecimals, [spread](const Row& row) { return spread(row).max(); }});
}

/// Cells of a text table under their headings.
struct TextTable {
  struct Heading {
    std::string text;
    int decimals = 0;
    double scale = 1;
  };
  std::vector<Heading> headings;
  std::vector<std::vector<Json>> rows;
};

/// The table as lines of text, columns as wide as their widest cell: words to the left, numbers to the right.
std::string textOf(const TextTable& table);

/// A Markdown table; the first `text_columns` are aligned to the left, the others to the right.
std::string markdownTable(const std::vector<std::string>& headings, std::size_t text_columns,
                          const std::vector<std::vector<std::string>>& rows);

/// A line of text for each row; empty where there are no rows.
template <typename Row, typename Rows>
std::string tableText(const std::vector<Column<Row>>& columns, const Rows& rows) {
  TextTable table;
  for (const Column<Row>& column : columns) {
    if (!column.heading.empty()) table.headings.push_back({column.heading, column.decimals, column.scale});
  }
  for (const Row& row : rows) {
    auto& cells = table.rows.emplace_back();
    for (const Column<Row>& column : columns) {
      if (!column.heading.empty()) cells.push_back(column.figure(row));
    }
  }
  return textOf(table);
}

/// A JSON array with an object for each row.
template <typename Row, typename Rows>
Json tableJson(const std::vector<Column<Row>>& columns, const Rows& rows) {
  Json list = Json::array();
  for (const Row& row : rows) {
    Json& object = list.emplace_back(Json::object());
    for (const Column<Row>& column : columns) {
      if (column.key.empty()) continue;
      Json figure = column.figure(row);
      if (!figure.is_discarded()) object[Json::json_pointer(column.key)] = std::move(figure);
    }
  }
  return list;
}

}  // namespace hapticd::tools
