// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/point_files.h"

#include "rt/depth/depth_frame.h"
#include "tools/lib/registration/point_table.h"

namespace hapticd::tools {
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

}  // namespace hapticd::tools
