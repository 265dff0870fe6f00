// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/parameter_columns.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/lib/trace/columns.h"
#include "tools/lib/trace/trace_settings.h"

namespace hapticd::tools {
namespace {

/// A name that HDF5 accepts: it takes slashes for paths through groups, and "." and ".." for groups.
std::string datasetName(std::string name) {
  std::ranges::replace(name, '/', '_');
  std::ranges::replace(name, '\0', '_');
  const bool is_name = std::ranges::any_of(name, [](char c) { return c != '.'; });
  return is_name ? name : "unnamed";
}

}  // namespace

ParameterColumns::ParameterColumns(hid_t group, const std::string& name)
    : group_(::H5Gcreate2(group, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), ::H5Gclose) {}

void ParameterColumns::Column::add(const std::string* value) {
  if (numeric) {
    const double number = value == nullptr ? std::nan("") : numberIn(*value).value_or(std::nan(""));
    data.add(&number, sizeof number);
  } else {
    data.add(value == nullptr ? std::string() : *value);
  }
  data.endRow();
}

ParameterColumns::Column& ParameterColumns::columnFor(const std::string& name,
                                                      const std::string& first_value) {
  const auto found = columns_.find(name);
  if (found != columns_.end()) return found->second;
  const bool numeric = numberIn(first_value).has_value();
  const Hdf5Handle text = hdf5TextType();
  const hid_t type = numeric ? H5T_NATIVE_DOUBLE : static_cast<hid_t>(text);
  Column& column = columns_.emplace(name, Column{Hdf5Column(group_, name, type, 1), numeric}).first->second;
  if (numeric) addAttribute(column.data.dataset(), "unit", std::string(unitOf(name)));
  for (std::uint64_t row = 0; row < rows_; ++row) column.add(nullptr);
  return column;
}

void ParameterColumns::addRow(const std::vector<std::pair<std::string, std::string>>& parameters) {
  std::map<std::string, const std::string*> values;
  for (const auto& [name, value] : parameters) values[datasetName(name)] = &value;
  for (const auto& [name, value] : values) columnFor(name, *value);
  for (auto& [name, column] : columns_) {
    const auto value = values.find(name);
    column.add(value == values.end() ? nullptr : value->second);
  }
  ++rows_;
}

bool ParameterColumns::finish() {
  bool good = group_.good();
  for (auto& [name, column] : columns_) good = column.data.finish() && good;
  return group_.close() && good;
}

}  // namespace hapticd::tools
