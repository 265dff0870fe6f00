// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hapticd::tools {

/// A table for people: a header, and columns as wide as their cells. On a terminal it is fitted to the width:
/// the last column, which holds text, is wrapped within what the others leave, or is on lines of its own
/// below its row where they leave too little. Nothing is ever cut, because names and values are copied from
/// tables.
class Table {
 public:
  struct Column {
    std::string title;
    bool right = false;  ///< for numbers, which are aligned to the right of their column
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// Adds a row with as many cells as there are columns.
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

  /// The lines, each with its end. columns: of the terminal; TerminalSize::kNoLimit: each row in one line.
  std::string text(std::size_t columns) const;

 private:
  using Cells = std::vector<std::string>;
  std::size_t widthOf(std::size_t column) const;

  std::vector<Column> columns_;
  std::vector<Cells> rows_;
};

}  // namespace hapticd::tools
