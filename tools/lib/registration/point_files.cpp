// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/point_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <optional>
#include <string_view>

#include "config/csv_names.h"
#include "config/value_text.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {
namespace {

using config::Error;
using Fields = std::vector<std::string_view>;

constexpr std::size_t kMaxErrors = 20;
constexpr double kFarthest_m = 20;  // no haptic workspace and no depth camera reaches farther

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

Fields fieldsOf(std::string_view line) {
  Fields fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

/// Returns `text` as a number; nothing if it is not one as a whole.
template <typename T>
std::optional<T> numberOf(std::string_view text) {
  T number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Reads the lines of one file and gathers what is wrong with them.
class Table {
 public:
  Table(std::filesystem::path file, std::string_view header) : file_(std::move(file)), header_(header) {}

  /// Calls `take` with the fields of each line below the header, all of them there.
  void readInto(const std::function<void(const Fields&)>& take) {
    std::ifstream in(file_);
    if (!in || std::filesystem::is_directory(file_)) {
      errors_.push_back({file_.string(), "cannot be read", "check the name of the file"});
      return;
    }
    bool in_header = true;
    for (std::string line; std::getline(in, line);) {
      ++line_;
      const std::string_view row = trimmed(line_ == 1 ? config::withoutByteOrderMark(line) : line);
      if (row.empty() || row.starts_with('#')) continue;
      if (in_header && config::csvNames(row) != config::csvNames(header_)) break;
      if (!in_header) takeRow(row, take);
      in_header = false;
    }
    if (in_header) report(fmt::format("the header '{}' is missing", header_), "make it the first line");
  }

  template <typename T>
  T number(std::string_view column, std::string_view text, T lowest, T highest) {
    const std::optional<T> value = numberOf<T>(text);
    // written so that a value that is not a number is out of range
    if (value && *value >= lowest && *value <= highest) return *value;
    report(fmt::format("{}: {} is {} (allowed: {}..{})", column, config::inQuotes(text),
                       value ? "out of range" : "no number", lowest, highest));
    return {};
  }

  std::string name(std::string_view text) {
    if (text.empty()) report("the name is missing");
    if (std::ranges::find(names_, text) != names_.end())
      report(fmt::format("{} is there twice", config::inQuotes(text)));
    return names_.emplace_back(text);
  }

  std::vector<Error>& errors() { return errors_; }

 private:
  void takeRow(std::string_view row, const std::function<void(const Fields&)>& take) {
    const Fields fields = fieldsOf(row);
    const auto expected = static_cast<std::size_t>(std::ranges::count(header_, ',')) + 1;
    if (fields.size() == expected) return take(fields);
    report(fmt::format("{} columns where {} are expected ({})", fields.size(), expected, header_));
  }

  void report(std::string what, std::string remedy = "") {
    if (errors_.size() >= kMaxErrors) return;
    errors_.push_back({fmt::format("{}:{}", file_.string(), line_), std::move(what), std::move(remedy)});
  }

  std::filesystem::path file_;
  std::string_view header_;
  std::size_t line_ = 0;
  std::vector<std::string> names_;
  std::vector<Error> errors_;
};

rt::Vec3 pointAt(Table& table, const Fields& fields, std::size_t first) {
  const Fields columns = fieldsOf(kPairsHeader);
  const auto at = [&](std::size_t i) {
    return table.number(columns[i], fields[i], -kFarthest_m, kFarthest_m);
  };
  return {at(first), at(first + 1), at(first + 2)};
}

}  // namespace

FileOf<PointPair> readPointPairs(const std::filesystem::path& file) {
  Table table(file, kPairsHeader);
  std::vector<PointPair> pairs;
  table.readInto([&](const Fields& fields) {
    pairs.push_back({table.name(fields[0]), pointAt(table, fields, 1), pointAt(table, fields, 4)});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return pairs;
}

FileOf<Landmark> readLandmarks(const std::filesystem::path& file) {
  Table table(file, kLandmarksHeader);
  std::vector<Landmark> landmarks;
  table.readInto([&](const Fields& fields) {
    landmarks.push_back({table.name(fields[0]),
                         table.number("column_px", fields[1], 0, rt::kMaxFrameWidth - 1),
                         table.number("row_px", fields[2], 0, rt::kMaxFrameHeight - 1)});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return landmarks;
}

}  // namespace hapticd::tools
