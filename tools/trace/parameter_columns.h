// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/trace/hdf5_file.h"

namespace hapticd::tools {

/// The parameters of directives as datasets of a group, one each: numbers as numbers, truth values as 1 and
/// 0, others as texts. A record that lacks a parameter leaves NaN or an empty text.
class ParameterColumns {
 public:
  ParameterColumns(hid_t group, const std::string& name);

  void addRow(const std::vector<std::pair<std::string, std::string>>& parameters);
  /// Writes what is left.  False: something could not be written.
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
