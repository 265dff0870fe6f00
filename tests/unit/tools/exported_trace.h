// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
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

/// An HDF5 file, read without the code that wrote it.
class Hdf5 {
 public:
  explicit Hdf5(const std::filesystem::path& file)
      : file_(::H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)) {}
  ~Hdf5() { ::H5Fclose(file_); }
  bool has(const char* dataset) const { return ::H5Lexists(file_, dataset, H5P_DEFAULT) > 0; }

  template <typename Number>
  std::vector<Number> numbers(const char* dataset, hid_t type) const {
    const hid_t data = ::H5Dopen2(file_, dataset, H5P_DEFAULT);
    const hid_t space = ::H5Dget_space(data);
    std::vector<Number> values(static_cast<std::size_t>(::H5Sget_simple_extent_npoints(space)));
    EXPECT_GE(::H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << dataset;
    ::H5Sclose(space);
    ::H5Dclose(data);
    return values;
  }
  std::vector<std::string> texts(const char* dataset) const {
    const hid_t data = ::H5Dopen2(file_, dataset, H5P_DEFAULT);
    std::vector<std::string> values = textsOf(data, ::H5Dget_space(data), [&](hid_t type, void* to) {
      return ::H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to);
    });
    ::H5Dclose(data);
    return values;
  }
  double numericAttribute(const char* object, const char* name) const {
    const hid_t attribute = ::H5Aopen_by_name(file_, object, name, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = ::H5Aget_type(attribute);
    EXPECT_NE(::H5Tget_class(type), H5T_STRING) << name;
    double value = std::nan("");
    EXPECT_GE(::H5Aread(attribute, H5T_NATIVE_DOUBLE, &value), 0) << name;
    ::H5Tclose(type);
    ::H5Aclose(attribute);
    return value;
  }
  std::vector<std::string> attribute(const char* object, const char* name) const {
    const hid_t attribute = ::H5Aopen_by_name(file_, object, name, H5P_DEFAULT, H5P_DEFAULT);
    std::vector<std::string> values =
        textsOf(attribute, ::H5Aget_space(attribute),
                [&](hid_t type, void* to) { return ::H5Aread(attribute, type, to); });
    ::H5Aclose(attribute);
    return values;
  }

 private:
  template <typename Read>
  static std::vector<std::string> textsOf(hid_t, hid_t space, Read read) {
    const hid_t type = ::H5Tcopy(H5T_C_S1);
    ::H5Tset_size(type, H5T_VARIABLE);
    ::H5Tset_cset(type, H5T_CSET_UTF8);
    std::vector<char*> pointers(static_cast<std::size_t>(::H5Sget_simple_extent_npoints(space)));
    EXPECT_GE(read(type, pointers.data()), 0);
    std::vector<std::string> texts(pointers.begin(), pointers.end());
    ::H5Dvlen_reclaim(type, space, H5P_DEFAULT, pointers.data());
    ::H5Tclose(type);
    ::H5Sclose(space);
    return texts;
  }

  hid_t file_;
};

}  // namespace hapticd::test
