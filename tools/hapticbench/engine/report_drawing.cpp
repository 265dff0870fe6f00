// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/report_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {
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

bool isNumber(const Json& cell) {
  return cell.is_number();
}

/// Whether a column holds words for people: such columns name a row.
bool holdsWords(const Figures& table, std::size_t column) {
  return std::ranges::any_of(table.rows, [column](const auto& row) { return row[column].is_string(); });
}

std::string textOfCell(const Json& cell, const Figures::Heading& heading) {
  if (cell.is_string()) return cell.get<std::string>();
  if (isNumber(cell)) return fmt::format("{:g}", heading.scale * cell.get<double>());
  return "";
}

/// Names of the rows: the words before the first figure that is not one of them, and numbers that they need
/// to differ.
std::vector<std::string> labelsOf(const Figures& table) {
  std::vector<std::string> labels(table.rows.size());
  const auto append = [&](std::size_t column) {
    for (std::size_t row = 0; row < labels.size(); ++row) {
      const std::string text = textOfCell(table.rows[row][column], table.headings[column]);
      if (text.empty()) continue;
      labels[row] += (labels[row].empty() ? "" : ", ") + text;
    }
  };
  const auto differ = [&] { return std::set(labels.begin(), labels.end()).size() == labels.size(); };
  std::size_t column = 0;
  while (column < table.headings.size() && holdsWords(table, column)) append(column++);
  while (column < table.headings.size() && !differ()) append(column++);
  for (std::string& label : labels) {
    if (label.size() > kMaxLabel) label = label.substr(0, kMaxLabel - 3) + "...";
  }
  return labels;
}

Drawn drawn(const NamedTable& table) {
  const Figures& figures = table.figures;
  Drawn result{table.name, labelsOf(figures), {}};
  for (std::size_t column = 0; column < figures.headings.size(); ++column) {
    const auto& [heading, decimals, scale] = figures.headings[column];
    Panel panel{heading, {}};
    for (const auto& row : figures.rows) {
      panel.values.push_back(isNumber(row[column]) ? scale * row[column].get<double>()
                                                   : std::numeric_limits<double>::quiet_NaN());
    }
    const bool has_any = std::ranges::any_of(panel.values, [](double value) { return std::isfinite(value); });
    if (has_any && !holdsWords(figures, column)) result.panels.push_back(std::move(panel));
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

std::string drawingOf(const std::vector<NamedTable>& tables, const std::filesystem::path& image) {
  std::vector<Drawn> all;
  for (const NamedTable& table : tables) {
    Drawn one = drawn(table);
    if (!one.panels.empty()) all.push_back(std::move(one));
  }
  return Script(std::move(all)).of(gnuplotTerminal(image));
}

}  // namespace hapticd::tools
