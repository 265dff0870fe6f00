// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/hip_csv.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>

#include "config/csv_names.h"
#include "config/value_text.h"
#include "rt/haptic_core.h"

namespace hapticd::tools {
namespace {

constexpr std::string_view kHeader = "t_s,x_m,y_m,z_m";
constexpr std::array<std::string_view, 4> kColumns{"t_s", "x_m", "y_m", "z_m"};
constexpr double kLongest_s = 1e9;  // nanoseconds of it fit into 64 bits
constexpr std::size_t kMaxErrors = 20;

std::string_view withoutCarriageReturn(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// Returns `text` as a number; nothing if it is not one as a whole.
std::optional<double> numberOf(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

class Parser {
 public:
  explicit Parser(std::string file) : file_(std::move(file)) {}

  void parse(std::string_view line, std::size_t number) {
    std::array<double, 4> values{};
    std::size_t column = 0;
    for (std::string_view rest = line;; ++column) {
      const std::size_t comma = rest.find(',');
      const std::string_view field = rest.substr(0, comma);
      if (column < values.size() && !check(field, column, number, values[column])) return;
      if (comma == std::string_view::npos) break;
      rest.remove_prefix(comma + 1);
    }
    if (column + 1 != values.size()) {
      return report(number, fmt::format("{} columns where 4 are expected ({})", column + 1, kHeader));
    }
    samples.push_back({values[0], {values[1], values[2], values[3]}});
  }

  void report(std::size_t number, std::string what, std::string remedy = "") {
    if (errors.size() < kMaxErrors) {
      errors.push_back({fmt::format("{}:{}", file_, number), std::move(what), std::move(remedy)});
    }
  }

  std::vector<HipSample> samples;
  std::vector<config::Error> errors;

 private:
  bool check(std::string_view field, std::size_t column, std::size_t number, double& value) {
    const bool is_time = column == 0;
    const double low = is_time ? 0 : -rt::kWorkspaceHalfEdge_m;
    const double high = is_time ? kLongest_s : rt::kWorkspaceHalfEdge_m;
    const std::optional<double> parsed = numberOf(field);
    // written so that a value that is not a number is out of range
    if (parsed && *parsed >= low && *parsed <= high) {
      value = *parsed;
      return true;
    }
    report(number, fmt::format("{}: {} is {} (allowed: {}..{} {})", kColumns[column], config::inQuotes(field),
                               parsed ? "out of range" : "no number", low, high, is_time ? "s" : "m"));
    return false;
  }

  std::string file_;
};

}  // namespace

std::expected<std::vector<HipSample>, std::vector<config::Error>> readHipCsv(
    const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in || std::filesystem::is_directory(file)) {
    return std::unexpected(std::vector{config::Error{file.string(), "cannot be read", "check --hip"}});
  }
  Parser parser(file.string());
  std::string line;
  std::size_t number = 1;
  if (!std::getline(in, line) || config::csvNames(line) != config::csvNames(kHeader)) {
    parser.report(1, fmt::format("the header '{}' is missing", kHeader), "make it the first line");
    return std::unexpected(parser.errors);
  }
  while (std::getline(in, line)) {
    ++number;
    const std::string_view row = withoutCarriageReturn(line);
    if (!row.empty()) parser.parse(row, number);
  }
  if (!parser.errors.empty()) return std::unexpected(parser.errors);
  return std::move(parser.samples);
}

}  // namespace hapticd::tools
