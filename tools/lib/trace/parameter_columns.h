// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/lib/trace/hdf5_file.h"

namespace hapticd::tools {

/// Writes the parameters of directives as datasets of a group, one for each parameter: numbers as numbers,
/// booleans as 1 and 0, others as texts. A record that lacks a parameter gives NaN or an empty text.
class ParameterColumns {
 public:
  ParameterColumns(hid_t group, const std::string& name);

  void addRow(const std::vector<std::pair<std::string, std::string>>& parameters);
  /// Writes the remaining rows; false if something could not be written.
  bool finish();

 private:
  struct Column {
    Hdf5Column data;
    bool numeric;
    void add(const std::string* value);
  };
  Column& columnFor(const std::string& name, const std::string& first_value);

  Hdf5Handle group_;
  std::map<std::string, Column> columns_;
  std::uint64_t rows_ = 0;
};

}  // namespace hapticd::tools
