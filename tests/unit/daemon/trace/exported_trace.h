// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/file_content.h"

/// Exported traces, read without the code that wrote them.
namespace hapticd::test {

using Rows = std::vector<std::vector<std::string>>;

/// Returns the fields of a CSV file by RFC 4180.
inline Rows rowsOf(const std::filesystem::path& csv) {
  Rows rows(1, {""});
  bool quoted = false;
  const std::string text = contentOf(csv);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && quoted && text[i + 1] == '"') {
      rows.back().back() += text[i++];
    } else if (text[i] == '"') {
      quoted = !quoted;
    } else if (text[i] == ',' && !quoted) {
      rows.back().emplace_back();
    } else if (text[i] == '\n' && !quoted) {
      rows.emplace_back(1, "");
    } else {
      rows.back().back() += text[i];
    }
  }
  rows.pop_back();  // behind the last line's end
  return rows;
}

/// The value of a row by the name of its column.
inline std::string cell(const Rows& rows, std::size_t row, const std::string& column) {
  const auto found = std::ranges::find(rows.at(0), column);
  if (found == rows[0].end()) return "no column " + column;
  return rows.at(row).at(static_cast<std::size_t>(found - rows[0].begin()));
}

inline double number(const Rows& rows, std::size_t row, const std::string& column) {
  return std::strtod(cell(rows, row, column).c_str(), nullptr);
}

}  // namespace hapticd::test
