// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/point_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>

#include "config/base/csv_names.h"
#include "config/base/value_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kMaxErrors = 20;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

PointTable::Fields fieldsOf(std::string_view line) {
  PointTable::Fields fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

}  // namespace

PointTable::PointTable(std::filesystem::path file, std::string_view header, std::string remedy)
    : file_(std::move(file)), header_(header), remedy_(std::move(remedy)) {}

void PointTable::readInto(const std::function<void(const Fields&)>& take) {
  std::ifstream in(file_);
  if (!in || std::filesystem::is_directory(file_)) {
    errors_.push_back({file_.string(), "cannot be read", remedy_});
    return;
  }
  bool in_header = true;
  for (std::string line; std::getline(in, line);) {
    ++line_;
    const std::string_view row = trimmed(line_ == 1 ? base::withoutByteOrderMark(line) : line);
    if (row.empty() || row.starts_with('#')) continue;
    if (in_header && base::csvNames(row) != base::csvNames(header_)) break;
    if (!in_header) takeRow(row, take);
    in_header = false;
  }
  line_ = std::max<std::size_t>(line_, 1);
  if (in_header) report(fmt::format("the header '{}' is missing", header_), "make it the first line");
}

double PointTable::number(std::size_t column, const Fields& fields, double lowest, double highest,
                          std::string_view unit) {
  return numberIn(column, fields, lowest, highest, unit);
}

int PointTable::integer(std::size_t column, const Fields& fields, int lowest, int highest) {
  return numberIn(column, fields, lowest, highest, "");
}

template <typename T>
T PointTable::numberIn(std::size_t column, const Fields& fields, T lowest, T highest, std::string_view unit) {
  const std::optional<T> value = base::numberFrom<T>(fields[column]);
  // written so that a value that is not a number is out of range
  if (value && *value >= lowest && *value <= highest) return *value;
  report(fmt::format("{}: {} is {} (allowed: {}..{}{}{})", fieldsOf(header_)[column],
                     base::inQuotes(fields[column]), value ? "out of range" : "no number", lowest, highest,
                     unit.empty() ? "" : " ", unit));
  return {};
}

std::string PointTable::name(std::string_view text) {
  if (text.empty()) report("the name is missing");
  if (std::ranges::find(names_, text) != names_.end())
    report(fmt::format("{} is there twice", base::inQuotes(text)));
  return names_.emplace_back(text);
}

void PointTable::takeRow(std::string_view row, const std::function<void(const Fields&)>& take) {
  const Fields fields = fieldsOf(row);
  const std::size_t expected = fieldsOf(header_).size();
  if (fields.size() == expected) return take(fields);
  report(fmt::format("{} columns where {} are expected ({})", fields.size(), expected, header_));
}

void PointTable::report(std::string what, std::string remedy) {
  if (errors_.size() >= kMaxErrors) return;
  errors_.push_back({fmt::format("{}:{}", file_.string(), line_), std::move(what), std::move(remedy)});
}

}  // namespace hapticd::tools
