// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "tools/hapticbench/engine/measures.h"

/// A study's figures and limits, described once for all its reports: text for people, JSON for programs,
/// pictures, Markdown for the documents.
namespace hapticd::tools {

/// What a cell of a table holds, before it is text.
class Figure {
 public:
  /// One that the row does not have: a blank cell in text, no member in JSON.
  Figure() = default;
  /// One that is not known: a dash in text, null in JSON.
  Figure(std::nullptr_t) : value_(nullptr) {}
  Figure(bool value) : value_(value) {}
  Figure(double value) : value_(value) {}
  Figure(std::string value) : value_(std::move(value)) {}
  Figure(std::string_view value) : value_(std::string(value)) {}
  Figure(const char* value) : value_(std::string(value)) {}
  template <std::integral Whole>
  Figure(Whole value) : value_(static_cast<std::int64_t>(value)) {}
  /// Not known where it is empty.
  Figure(const std::optional<double>& value) {
    if (value) {
      value_ = *value;
    } else {
      value_ = nullptr;
    }
  }

  /// `figure` where the row has it.
  static Figure where(bool has, Figure figure) { return has ? std::move(figure) : Figure(); }

  bool isWord() const { return std::holds_alternative<std::string>(value_); }
  /// Words and truth values stand at the left of their column.
  bool isText() const { return isWord() || std::holds_alternative<bool>(value_); }
  std::optional<double> number() const;
  /// `scale`, `decimals`: of numbers that are not whole.
  std::string text(int decimals, double scale) const;
  /// Writes it to `member()`, unless the row does not have it.
  void write(const std::function<nlohmann::ordered_json&()>& member) const;

 private:
  std::variant<std::monostate, std::nullptr_t, bool, std::int64_t, double, std::string> value_;
};

/// A figure of a row, and how it is shown. All rows of a table have the same cells.
struct Cell {
  std::string key;      ///< JSON pointer of the member: "/gap_m", "/error_n/rms"; empty: not in JSON
  std::string heading;  ///< in text, with the unit; empty: not in text
  int decimals = 0;     ///< in text, of numbers that are not whole
  Figure figure;
  double scale = 1;  ///< in text: 1000 shows metres as millimetres
};
using Row = std::vector<Cell>;

/// The cells one after the other.
Row joined(Row row, const Row& more);

/// The RMS and the maximum of a spread: the members "rms" and "max" of the object at `key`.
Row spreadCells(const std::string& key, const std::string& rms_heading, const std::string& max_heading,
                const Spread& spread);

/// The rows of a table: `cells(item)` of each.
template <typename Items, typename Cells>
std::vector<Row> rowsOf(const Items& items, const Cells& cells) {
  std::vector<Row> rows;
  for (const auto& item : items) rows.push_back(cells(item));
  return rows;
}

/// A Markdown table; the first `text_columns` are aligned to the left, the others to the right.
std::string markdownTable(const std::vector<std::string>& headings, std::size_t text_columns,
                          const std::vector<std::vector<std::string>>& rows);

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

/// The figure of a row that a requirement limits, and the most that it may be.
struct Limit {
  std::string text;
  bool applies = true;  ///< to this row
  double value = 0;
  double limit = 0;
  std::string law{};  ///< empty: that of checked()
};

/// Counts another row in the requirements that its limits, in the same order, are of.
void checkRow(std::vector<Requirement>& requirements, const std::vector<Limit>& limits,
              const std::string& row);

/// Checks for each law, or whatever divides the items, what `limits_of(item)` says, the same limits in the
/// same order for each item, of the items that `belongs(item, law)` holds for; the worst one is the one
/// farthest beyond its limit or nearest to it. `describe` names an item.
template <typename Item, typename Belongs, typename LimitsOf, typename Describe>
std::vector<Requirement> checked(const std::vector<std::string>& laws, const std::vector<Item>& items,
                                 const Belongs& belongs, const LimitsOf& limits_of,
                                 const Describe& describe) {
  std::vector<Requirement> all;
  for (const std::string& law : laws) {
    std::vector<Requirement> of_law;
    for (const Limit& limit : limits_of(Item{}))
      of_law.push_back(Requirement::notMeasured(limit.law.empty() ? law : limit.law, limit.text));
    for (const Item& item : items) {
      if (belongs(item, law)) checkRow(of_law, limits_of(item), describe(item));
    }
    all.insert(all.end(), of_law.begin(), of_law.end());
  }
  return all;
}

/// What a study tells, part by part.
class Report {
 public:
  Report();

  /// For people alone.
  void say(const std::string& text) { text_ += text; }
  /// For programs alone: a member of the document, by its JSON pointer.
  void note(const std::string& pointer, const Figure& figure);
  /// For programs alone: the rows as an array of objects.
  void note(const std::string& pointer, const std::vector<Row>& rows);
  /// The document, for what is not a figure.
  nlohmann::ordered_json& document() { return *document_; }
  /// The rows as a table below `title`, unless there are none, and as the array `name`.
  void table(const std::string& name, const std::string& title, const std::vector<Row>& rows) {
    show(name, title, rows);
    note("/" + name, rows);
  }
  /// The same without JSON; `name`: of the table in a drawing.
  void show(const std::string& name, const std::string& title, std::vector<Row> rows);
  void requirements(const std::vector<Requirement>& requirements);

  /// The script by which gnuplot draws the report into an image with this ending.
  using Drawing = std::function<std::string(const std::filesystem::path& image)>;
  void drawAs(Drawing drawing) { drawing_ = std::move(drawing); }
  /// Without drawAs() the tables are drawn: for each a row of panels, one for each column of numbers, in
  /// which a point stands for each row of the table. The words that name a row stand beside the first panel.
  /// A panel has a logarithmic axis where all its numbers are positive and span more than a factor of 50.
  /// Tables without numbers are left out.
  std::string drawing(const std::filesystem::path& image) const;

  const std::string& text() const { return text_; }
  std::string json() const;

 private:
  /// A table as people see it: cells without a heading are left out.
  struct Shown {
    std::string name;
    std::vector<Row> rows;
  };

  std::string text_;
  std::shared_ptr<nlohmann::ordered_json> document_;
  std::vector<Shown> tables_;
  Drawing drawing_;
};

}  // namespace hapticd::tools
