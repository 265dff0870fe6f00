// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/text/table.h"

#include <algorithm>

#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kGap = 2;
/// A last column narrower than this would hold hardly more than one word a line.
constexpr std::size_t kNarrowestText = 24;
const std::string kIndentBelow(4, ' ');

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string blanks(width - std::min(columnsOf(text), width), ' ');
  return right ? blanks + text : text + blanks;
}

std::string withoutBlanksAtTheEnd(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace

std::size_t Table::widthOf(std::size_t column) const {
  std::size_t width = columnsOf(columns_[column].title);
  for (const Cells& row : rows_) width = std::max(width, columnsOf(row[column]));
  return width;
}

std::string Table::text(std::size_t columns) const {
  std::vector<std::size_t> all_widths;  // except the last one's, whose cells end their line
  for (std::size_t i = 0; i + 1 < columns_.size(); ++i) all_widths.push_back(widthOf(i));
  const std::size_t last_width = columns_.back().right ? widthOf(columns_.size() - 1) : 0;
  std::size_t before = 0;  // the last column
  for (const std::size_t width : all_widths) before += width + kGap;
  const bool unlimited = columns == TerminalSize::kNoLimit;
  const bool beside = unlimited || before + kNarrowestText <= columns;
  const bool aligned = unlimited || before <= columns;

  const auto lineOf = [&](const Cells& cells) {
    std::string line;
    for (std::size_t i = 0; i < all_widths.size(); ++i) {
      line += padded(cells[i], aligned ? all_widths[i] : 0, columns_[i].right) + std::string(kGap, ' ');
    }
    if (unlimited) return withoutBlanksAtTheEnd(line + padded(cells.back(), last_width, true));
    if (beside && !cells.back().empty()) {
      return wrapped(line + cells.back(), columns, std::string(before, ' '));
    }
    line = wrapped(withoutBlanksAtTheEnd(line), columns, kIndentBelow);
    if (!beside && !cells.back().empty()) {
      line += "\n" + wrapped(kIndentBelow + cells.back(), columns, kIndentBelow);
    }
    return line;
  };

  Cells titles;
  for (const Column& column : columns_) titles.push_back(column.title);
  std::string text = lineOf(titles) + "\n";
  for (const Cells& row : rows_) text += lineOf(row) + "\n";
  return text;
}

}  // namespace hapticd::tools
