// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

namespace hapticd::tools {

/// Reads the lines of a CSV file of points and gathers what is wrong with them, up to as many errors as a
/// person would read. LF or CRLF; empty lines and lines that begin with '#' are passed over.
class PointTable {
 public:
  using Fields = std::vector<std::string_view>;

  /// `header`: the names of the columns. `remedy`: where the file cannot be read.
  PointTable(std::filesystem::path file, std::string_view header, std::string remedy);

  /// Calls `take` with the fields of each line below the header, all of them there.
  void readInto(const std::function<void(const Fields&)>& take);

  /// The field of a column as a number; any, after an error, if it is none in the range. `unit`: of the
  /// range.
  double number(std::size_t column, const Fields& fields, double lowest, double highest,
                std::string_view unit);
  int integer(std::size_t column, const Fields& fields, int lowest, int highest);
  /// The field as a name that no other line has.
  std::string name(std::string_view text);

  std::vector<base::Error>& errors() { return errors_; }

 private:
  template <typename T>
  T numberIn(std::size_t column, const Fields& fields, T lowest, T highest, std::string_view unit);
  void takeRow(std::string_view row, const std::function<void(const Fields&)>& take);
  void report(std::string what, std::string remedy = "");

  std::filesystem::path file_;
  std::string_view header_;
  std::string remedy_;
  std::size_t line_ = 0;
  std::vector<std::string> names_;
  std::vector<base::Error> errors_;
};

}  // namespace hapticd::tools
