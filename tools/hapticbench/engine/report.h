// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tools/hapticbench/engine/measures.h"

/// A study's figures and limits, described once for all its reports: text for people, JSON for programs,
/// Markdown for the documents.
namespace hapticd::tools {

using Json = nlohmann::ordered_json;

/// A figure that a row does not have: a blank cell in text, no member in JSON.
inline Json noFigure() {
  return Json(Json::value_t::discarded);
}
inline Json figureWhere(bool has, Json figure) {
  return has ? std::move(figure) : noFigure();
}
/// A dash in text, null in JSON where it is not known.
inline Json ifKnown(const std::optional<double>& figure) {
  return figure ? Json(*figure) : Json();
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

template <typename Row>
using Columns = std::vector<Column<Row>>;

/// The columns one after the other.
template <typename Row>
Columns<Row> joined(Columns<Row> columns, const Columns<Row>& more) {
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

/// Adds the RMS and the maximum of a spread: the members "rms" and "max" of the object at `key`.
template <typename Row, typename SpreadOf>
void addSpread(Columns<Row>& columns, const std::string& key, const std::string& rms_heading,
               const std::string& max_heading, const SpreadOf& spread) {
  constexpr int kDecimals = 2;
  columns.push_back(
      {key + "/rms", rms_heading, kDecimals, [spread](const Row& row) { return spread(row).rms(); }});
  columns.push_back(
      {key + "/max", max_heading, kDecimals, [spread](const Row& row) { return spread(row).max(); }});
}

/// Figures under the headings of a table, before they are text.
struct Figures {
  struct Heading {
    std::string text;
    int decimals = 0;
    double scale = 1;
  };
  std::vector<Heading> headings;
  std::vector<std::vector<Json>> rows;
};

/// A table as lines of text, columns as wide as their widest cell: words to the left, numbers to the right.
std::string textOf(const Figures& figures);

/// A Markdown table; the first `text_columns` are aligned to the left, the others to the right.
std::string markdownTable(const std::vector<std::string>& headings, std::size_t text_columns,
                          const std::vector<std::vector<std::string>>& rows);

/// What a table shows as text.
template <typename Row, typename Rows>
Figures figuresOf(const Columns<Row>& columns, const Rows& rows) {
  Figures table;
  for (const Column<Row>& column : columns) {
    if (!column.heading.empty()) table.headings.push_back({column.heading, column.decimals, column.scale});
  }
  for (const Row& row : rows) {
    auto& cells = table.rows.emplace_back();
    for (const Column<Row>& column : columns) {
      if (!column.heading.empty()) cells.push_back(column.figure(row));
    }
  }
  return table;
}

/// A JSON array with an object for each row.
template <typename Row, typename Rows>
Json tableJson(const Columns<Row>& columns, const Rows& rows) {
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

/// A limit on a figure, and whether it is met.
struct Requirement {
  std::string law;   ///< empty: not of a single law
  std::string text;  ///< what is limited, with its unit at the end: "contact lost, %"
  double measured = 0;
  double limit = 0;
  bool at_least = false;     ///< else at most
  std::size_t cases = 1;     ///< that it was checked on; 0: not measured
  std::size_t violated = 0;  ///< of them
  std::string worst;         ///< the case that `measured` is of, where there are several

  bool met() const { return cases > 0 && violated == 0; }
  static Requirement atMost(std::string law, std::string text, double limit, double measured);
  static Requirement atLeast(std::string law, std::string text, double limit, double measured);
  static Requirement notMeasured(std::string law, std::string text);
};

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

/// A table with its name in drawings.
struct NamedTable {
  std::string name;
  Figures figures;
};

/// What a study tells, part by part.
class Report {
 public:
  /// For people alone.
  void say(const std::string& text) { text_ += text; }
  /// For programs alone: a member of the document.
  void note(const std::string& key, Json value) { document_[key] = std::move(value); }
  /// The rows as a table below `title`, unless there are none, and as the array `key`.
  template <typename Row, typename Rows>
  void table(const std::string& key, const std::string& title, const Columns<Row>& columns,
             const Rows& rows) {
    show(key, title, columns, rows);
    note(key, tableJson(columns, rows));
  }
  /// The same without JSON; `name`: of the table in a drawing.
  template <typename Row, typename Rows>
  void show(const std::string& name, const std::string& title, const Columns<Row>& columns,
            const Rows& rows) {
    Figures figures = figuresOf(columns, rows);
    if (figures.rows.empty()) return;
    say(title + textOf(figures));
    tables_.push_back({name, std::move(figures)});
  }
  void requirements(std::span<const Requirement> requirements);

  /// The script by which gnuplot draws the report into an image with this ending; without it the tables are
  /// drawn.
  using Drawing = std::function<std::string(const std::filesystem::path& image)>;
  void drawAs(Drawing drawing) { drawing_ = std::move(drawing); }
  std::string drawing(const std::filesystem::path& image) const;

  const std::string& text() const { return text_; }
  std::string json() const { return document_.dump(2) + "\n"; }

 private:
  std::string text_;
  Json document_ = Json::object();
  std::vector<NamedTable> tables_;
  Drawing drawing_;
};

}  // namespace hapticd::tools
