// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/lib/plot/gnuplot.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {

std::optional<double> Figure::number() const {
  if (const auto* whole = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*whole);
  const auto* number = std::get_if<double>(&value_);
  return number != nullptr ? std::optional(*number) : std::nullopt;
}

std::string Figure::text(int decimals, double scale) const {
  if (const auto* word = std::get_if<std::string>(&value_)) return *word;
  if (const auto* truth = std::get_if<bool>(&value_)) return *truth ? "yes" : "no";
  if (const auto* whole = std::get_if<std::int64_t>(&value_)) return fmt::format("{}", *whole);
  if (const auto* number = std::get_if<double>(&value_))
    return fmt::format("{:.{}f}", scale * *number, decimals);
  return std::holds_alternative<std::nullptr_t>(value_) ? "-" : "";
}

void Figure::write(const std::function<nlohmann::ordered_json&()>& member) const {
  std::visit(
      [&member](const auto& value) {
        if constexpr (!std::is_same_v<decltype(value), const std::monostate&>) member() = value;
      },
      value_);
}

Row joined(Row row, const Row& more) {
  row.insert(row.end(), more.begin(), more.end());
  return row;
}

Row spreadCells(const std::string& key, const std::string& rms_heading, const std::string& max_heading,
                const Spread& spread) {
  return {{key + "/rms", rms_heading, 2, spread.rms()}, {key + "/max", max_heading, 2, spread.max()}};
}

namespace {

/// Whether a column holds words for people: such columns name a row.
bool holdsWords(const std::vector<Row>& rows, std::size_t column) {
  return std::ranges::any_of(rows, [column](const Row& row) { return row[column].figure.isWord(); });
}

/// Lines of text, columns as wide as their widest cell: words to the left, numbers to the right.
std::string textOf(const std::vector<Row>& rows) {
  if (rows.empty()) return "";
  std::vector<Table::Column> columns;
  for (std::size_t i = 0; i < rows.front().size(); ++i) {
    const bool words = std::ranges::any_of(rows, [i](const Row& row) { return row[i].figure.isText(); });
    columns.push_back({rows.front()[i].heading, !words});
  }
  Table table(std::move(columns));
  for (const Row& row : rows) {
    std::vector<std::string> cells;
    for (const Cell& cell : row) cells.push_back(cell.figure.text(cell.decimals, cell.scale));
    table.add(std::move(cells));
  }
  return table.text(TerminalSize::kNoLimit);
}

/// Leaves out what text does not show.
void keepShown(std::vector<Row>& rows) {
  for (Row& row : rows) std::erase_if(row, [](const Cell& cell) { return cell.heading.empty(); });
}

/// Appends one line of Markdown.
void addLine(std::string& text, const std::vector<std::string>& cells) {
  text += "|";
  for (const std::string& cell : cells) text += " " + cell + " |";
  text += "\n";
}

}  // namespace

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

void checkRow(std::vector<Requirement>& requirements, const std::vector<Limit>& limits,
              const std::string& row) {
  constexpr double kRounding = 1e-9;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const Limit& figure = limits[i];
    Requirement& requirement = requirements[i];
    if (!figure.applies) continue;
    if (figure.value > figure.limit + kRounding) ++requirement.violated;
    const double beyond = figure.value - figure.limit;
    if (requirement.cases++ > 0 && beyond <= requirement.measured - requirement.limit) continue;
    requirement.measured = figure.value;
    requirement.limit = figure.limit;
    requirement.worst = row;
  }
}

Report::Report() : document_(std::make_shared<nlohmann::ordered_json>(nlohmann::ordered_json::object())) {}

void Report::note(const std::string& pointer, const Figure& figure) {
  figure.write([&]() -> nlohmann::ordered_json& {
    return (*document_)[nlohmann::ordered_json::json_pointer(pointer)];
  });
}

void Report::note(const std::string& pointer, const std::vector<Row>& rows) {
  auto& list = (*document_)[nlohmann::ordered_json::json_pointer(pointer)] = nlohmann::ordered_json::array();
  for (const Row& row : rows) {
    auto& object = list.emplace_back(nlohmann::ordered_json::object());
    for (const Cell& cell : row) {
      if (cell.key.empty()) continue;
      cell.figure.write([&]() -> nlohmann::ordered_json& {
        return object[nlohmann::ordered_json::json_pointer(cell.key)];
      });
    }
  }
}

void Report::show(const std::string& name, const std::string& title, std::vector<Row> rows) {
  if (rows.empty()) return;
  keepShown(rows);
  say(title + textOf(rows));
  tables_.push_back({name, std::move(rows)});
}

void Report::requirements(const std::vector<Requirement>& requirements) {
  std::vector<Row> rows = rowsOf(requirements, [](const Requirement& r) {
    const bool has = r.cases > 0;
    const std::string limit = fmt::format("{} {:g}", r.at_least ? "at least" : "at most", r.limit);
    return Row{{"", "verdict", 0,
                !has      ? "not measured"
                : r.met() ? "met"
                          : "not met"},
               {"/law", "law", 0, r.law},
               {"/text", "requirement", 0, r.text},
               {"/measured", "", 0, Figure::where(has, r.measured)},
               {"", "measured", 0, Figure::where(has, fmt::format("{:.3g}", r.measured))},
               {"/limit", "", 0, Figure::where(has, r.limit)},
               {"", "limit", 0, Figure::where(has, limit)},
               {"/at_least", "", 0, r.at_least},
               {"/cases", "cases", 0, r.cases},
               {"/violated", "violated", 0, r.violated},
               {"/met", "", 0, r.met()},
               {"/worst", "worst case", 0, r.worst}};
  });
  note("/requirements", rows);
  keepShown(rows);
  say("\nrequirements\n" + textOf(rows));
}

std::string Report::json() const {
  return document_->dump(2) + "\n";
}

namespace {

// Measures of the picture in pixels.
constexpr int kRow = 15;
constexpr int kPanel = 150;  ///< width
constexpr int kGap = 14;     ///< between panels
constexpr int kHead = 62;    ///< above the panels of a table: its title and the headings
constexpr int kFoot = 44;    ///< below them: the numbers of the axes
constexpr int kMargin = 12;
constexpr int kLetter = 7;
/// Pixels of a centimetre of a PDF.
constexpr double kPixelsPerCm = 60;
constexpr double kLogarithmicSpan = 50;
constexpr std::size_t kMaxLabel = 60;

/// A column of numbers of a table.
struct Panel {
  std::string heading;
  std::vector<double> values;  ///< of each row; not finite where it has none

  bool isLogarithmic() const {
    double least = std::numeric_limits<double>::infinity();
    double largest = 0;
    for (const double value : values) {
      if (!std::isfinite(value)) continue;
      least = std::min(least, value);
      largest = std::max(largest, value);
    }
    return least > 0 && largest > kLogarithmicSpan * least;
  }
};

/// A table as it is drawn.
struct Drawn {
  std::string title;
  std::vector<std::string> labels;  ///< of each row
  std::vector<Panel> panels;

  int height() const { return kHead + kRow * static_cast<int>(labels.size()) + kFoot; }
};

std::string labelOf(const Cell& cell) {
  if (cell.figure.isWord()) return cell.figure.text(0, 1);
  const auto number = cell.figure.number();
  return number ? fmt::format("{:g}", cell.scale * *number) : "";
}

/// Names of the rows: the words before the first figure that is not one of them, and numbers that they need
/// to differ.
std::vector<std::string> labelsOf(const std::vector<Row>& rows) {
  std::vector<std::string> labels(rows.size());
  const auto append = [&](std::size_t column) {
    for (std::size_t row = 0; row < labels.size(); ++row) {
      const std::string text = labelOf(rows[row][column]);
      if (text.empty()) continue;
      labels[row] += (labels[row].empty() ? "" : ", ") + text;
    }
  };
  const auto differ = [&] { return std::set(labels.begin(), labels.end()).size() == labels.size(); };
  const std::size_t columns = rows.front().size();
  std::size_t column = 0;
  while (column < columns && holdsWords(rows, column)) append(column++);
  while (column < columns && !differ()) append(column++);
  for (std::string& label : labels) {
    if (label.size() > kMaxLabel) label = label.substr(0, kMaxLabel - 3) + "...";
  }
  return labels;
}

Drawn drawn(const std::string& name, const std::vector<Row>& rows) {
  Drawn result{name, labelsOf(rows), {}};
  for (std::size_t column = 0; column < rows.front().size(); ++column) {
    Panel panel{rows.front()[column].heading, {}};
    for (const Row& row : rows) {
      const double number = row[column].figure.number().value_or(std::numeric_limits<double>::quiet_NaN());
      panel.values.push_back(row[column].scale * number);
    }
    const bool has_any = std::ranges::any_of(panel.values, [](double value) { return std::isfinite(value); });
    if (has_any && !holdsWords(rows, column)) result.panels.push_back(std::move(panel));
  }
  return result;
}

/// Writes a script.
class Script {
 public:
  explicit Script(std::vector<Drawn> tables) : tables_(std::move(tables)) {
    for (const Drawn& table : tables_) {
      height_ += table.height();
      for (const std::string& label : table.labels)
        label_width_ = std::max(label_width_, kLetter * static_cast<int>(label.size()));
    }
    for (const Drawn& table : tables_) width_ = std::max(width_, left(table.panels.size()));
    width_ += kMargin;
  }

  std::string of(const std::string& terminal) {
    if (terminal == "pdfcairo") {
      add("set terminal {} size {}cm,{}cm font 'Sans,6' background rgb 'white'\n", terminal,
          width_ / kPixelsPerCm, height_ / kPixelsPerCm);
    } else {
      add("set terminal {} size {},{} font 'Sans,9' background rgb 'white'\n", terminal, width_, height_);
    }
    add("set multiplot\nunset key\nset grid xtics lc rgb '#e0e0e0'\nset tics scale 0.5\n");
    int top = 0;
    for (std::size_t i = 0; i < tables_.size(); ++i) {
      addTable(i, top);
      top += tables_[i].height();
    }
    add("unset multiplot\n");
    return std::move(text_);
  }

 private:
  template <typename... Arguments>
  void add(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Arguments>(arguments)...);
  }

  int left(std::size_t panel) const {
    return kMargin + label_width_ + static_cast<int>(panel) * (kPanel + kGap);
  }
  double across(int pixels) const { return static_cast<double>(pixels) / width_; }
  /// gnuplot counts from below.
  double down(int pixels) const { return 1 - static_cast<double>(pixels) / height_; }

  void addTable(std::size_t number, int top) {
    const Drawn& table = tables_[number];
    const int rows = static_cast<int>(table.labels.size());
    add("set label 1 '{}' at screen {},{} left noenhanced font ',11'\n", gnuplotQuoted(table.title),
        across(kMargin), down(top + 20));
    add("set yrange [{}:-0.6]\nset tmargin at screen {}\nset bmargin at screen {}\n", rows - 0.4,
        down(top + kHead), down(top + kHead + kRow * rows));
    for (std::size_t i = 0; i < table.panels.size(); ++i) {
      const Panel& panel = table.panels[i];
      add("$p{}_{} << END\n", number, i);
      for (std::size_t row = 0; row < panel.values.size(); ++row) {
        if (std::isfinite(panel.values[row])) add("{:g} {}\n", panel.values[row], row);
      }
      add("END\nset lmargin at screen {}\nset rmargin at screen {}\n", across(left(i)),
          across(left(i) + kPanel));
      addLabels(i == 0 ? table.labels : std::vector<std::string>());
      add("set title '{}' noenhanced offset 0,-0.7\n{}\n", gnuplotQuoted(panel.heading),
          panel.isLogarithmic() ? "set logscale x" : "unset logscale x");
      add("set xtics rotate by -60 font ',7'\nset autoscale x\nset offsets graph 0.06,graph 0.06,0,0\n"
          "plot $p{}_{} using 1:2 with points pt 7 ps 0.6 lc rgb '#1060d0'\nunset label 1\n",
          number, i);
    }
  }

  void addLabels(const std::vector<std::string>& labels) {
    if (labels.empty()) return add("set ytics format ''\n");
    add("set ytics format '%s' noenhanced (");
    for (std::size_t i = 0; i < labels.size(); ++i)
      add("{}'{}' {}", i == 0 ? "" : ", ", gnuplotQuoted(labels[i]), i);
    add(")\n");
  }

  const std::vector<Drawn> tables_;
  int label_width_ = 0;
  int width_ = 0;
  int height_ = kMargin;
  std::string text_;
};

}  // namespace

std::string Report::drawing(const std::filesystem::path& image) const {
  if (drawing_) return drawing_(image);
  std::vector<Drawn> all;
  for (const auto& [name, rows] : tables_) {
    Drawn one = drawn(name, rows);
    if (!one.panels.empty()) all.push_back(std::move(one));
  }
  return Script(std::move(all)).of(gnuplotTerminal(image));
}

}  // namespace hapticd::tools
