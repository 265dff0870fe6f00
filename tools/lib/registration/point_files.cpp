// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/point_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include "config/base/value_text.h"
#include "rt/depth/depth_frame.h"

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
                     base::inQuotes(fields[column]), value ? "out of range" : "not a number", lowest, highest,
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

namespace {

constexpr double kFarthest_m = 20;  // no haptic workspace and no depth camera reaches farther
constexpr const char* kRemedy = "check the name of the file";

rt::Vec3 pointAt(PointTable& table, const PointTable::Fields& fields, std::size_t first) {
  const auto at = [&](std::size_t column) {
    return table.number(column, fields, -kFarthest_m, kFarthest_m, "m");
  };
  return {at(first), at(first + 1), at(first + 2)};
}

}  // namespace

FileOf<PointPair> readPointPairs(const std::filesystem::path& file) {
  PointTable table(file, kPairsHeader, kRemedy);
  std::vector<PointPair> pairs;
  table.readInto([&](const PointTable::Fields& fields) {
    pairs.push_back({table.name(fields[0]), pointAt(table, fields, 1), pointAt(table, fields, 4)});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return pairs;
}

FileOf<Landmark> readLandmarks(const std::filesystem::path& file) {
  PointTable table(file, kLandmarksHeader, kRemedy);
  std::vector<Landmark> landmarks;
  table.readInto([&](const PointTable::Fields& fields) {
    landmarks.push_back({table.name(fields[0]), table.integer(1, fields, 0, rt::kMaxFrameWidth - 1),
                         table.integer(2, fields, 0, rt::kMaxFrameHeight - 1)});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return landmarks;
}

namespace {

/// Raw values about the landmark that have a depth, and how many pixels were looked at.
std::vector<std::uint16_t> rawsAbout(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                     const rt::DepthModel& model, std::size_t& looked_at) {
  std::vector<std::uint16_t> raws;
  const int top = std::max(landmark.row_px - kLandmarkReach_px, 0);
  const int bottom = std::min(landmark.row_px + kLandmarkReach_px, model.height_px() - 1);
  const int left = std::max(landmark.column_px - kLandmarkReach_px, 0);
  const int right = std::min(landmark.column_px + kLandmarkReach_px, model.width_px() - 1);
  for (int row = top; row <= bottom; ++row) {
    for (int column = left; column <= right; ++column) {
      const std::uint16_t raw = frame[static_cast<std::size_t>(row * model.width_px() + column)];
      ++looked_at;
      if (model.depth_m(raw) > 0) raws.push_back(raw);
    }
  }
  return raws;
}

}  // namespace

base::Result<rt::Vec3> positionInCamera(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                        const rt::DepthModelParameters& parameters) {
  const rt::DepthModel model(parameters, {});  // a camera at the world's origin: world and camera frame agree
  if (landmark.column_px >= parameters.width_px || landmark.row_px >= parameters.height_px) {
    return std::unexpected(base::Error{
        landmark.name,
        fmt::format("column {}, row {} lies outside the image, which has {} x {} pixels", landmark.column_px,
                    landmark.row_px, parameters.width_px, parameters.height_px),
        "read the pixel off 'hapticctl snapshot --png' of the same camera"});
  }
  std::size_t looked_at = 0;
  std::vector<std::uint16_t> raws = rawsAbout(landmark, frame, model, looked_at);
  if (2 * raws.size() < looked_at) {
    return std::unexpected(base::Error{
        landmark.name,
        fmt::format("{} of {} pixels about column {}, row {} have a depth, at least half are needed",
                    raws.size(), looked_at, landmark.column_px, landmark.row_px),
        fmt::format("choose a place that shows in 'hapticctl snapshot --png', {}..{} m from the camera",
                    parameters.near_m, parameters.far_m)});
  }
  // raw values are monotonic in depth, so its median is that of the depths
  const auto middle = raws.begin() + static_cast<std::ptrdiff_t>(raws.size() / 2);
  std::ranges::nth_element(raws, middle);
  return model.pointInWorld(rt::PackedPixel::pack(static_cast<std::uint32_t>(landmark.column_px),
                                                  static_cast<std::uint32_t>(landmark.row_px), *middle),
                            *middle);
}

}  // namespace hapticd::tools
